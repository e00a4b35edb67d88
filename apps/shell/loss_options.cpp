#include "shell/loss_options.hpp"

#include <fmt/core.h>

#include "shell/help_groups.hpp"

namespace pulson {

void LossOptions::add_to(CLI::App& verb, const std::string& what) {
  begin_group(verb, kModelGroup);
  CLI::Option* tukey = verb.add_flag("--robust", robust, "wrong landmarks have no influence: the same as --loss tukey");
  begin_group(verb, more(kModelGroup));
  verb.add_option("--loss", loss,
                  fmt::format("{}: tukey, cauchy, huber or student, with its constant as in tukey:5", what))
      ->type_name("NAME[:K]")
      ->excludes(tukey);
}

std::optional<matching::RobustLoss> LossOptions::chosen() const {
  if (robust) return matching::RobustLoss{};
  return loss.empty() ? std::nullopt : std::optional(matching::parse_loss(loss));
}

}  // namespace pulson
