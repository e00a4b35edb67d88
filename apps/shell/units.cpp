#include "units.hpp"

#include <algorithm>
#include <charconv>
#include <sstream>
#include <system_error>

#include <fmt/format.h>

#include "config.hpp"
#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "help_groups.hpp"
#include "messages.hpp"
#include "path_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "ranks.hpp"
#include "verbs.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

// At most this part of the time is spent on saving. Long units are saved one by one: mpirun does not wait for those
// that are not finished when it ends a run.
constexpr double kPartForSaving = 0.01;
constexpr double kSecondsBetweenSaves = 10;

// On which no result depends.
const std::vector<std::string> kKeysOfOutput = {"out",     "json",  "no-picture", "pictures",
                                                "width",   "dpi",   "quiet",      "verbose",
                                                "threads", "shard", "resume",     "spreadsheet-safe"};

}  // namespace

void UnitOptions::add_to(CLI::App& verb, const std::string& units) {
  begin_group(verb, kManyGroup);
  verb.add_option("--shard", shard, fmt::format("part i of n of the {}, for pulson merge", units))->type_name("i/n");
  verb.add_flag("--resume", resume, fmt::format("continue with the {} that are saved in the folder", units));
}

ensemble::Shard parse_shard(const std::string& text) {
  ensemble::Shard shard;
  const std::size_t slash = text.find('/');
  const auto whole = [](std::string_view digits, int& number) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return error == std::errc() && end == digits.data() + digits.size();
  };
  const std::string_view view = text;
  if (slash == std::string::npos || !whole(view.substr(0, slash), shard.index) ||
      !whole(view.substr(slash + 1), shard.count) || shard.index < 1 || shard.index > shard.count)
    throw InputError(fmt::format("--shard is '{}'; it must be i/n, as in 3/8, i from 1 to n", text));
  return shard;
}

std::string settings_of(const CLI::App& verb) {
  std::istringstream lines(config_text(verb));
  std::string settings;
  for (std::string line; std::getline(lines, line);) {
    const std::string key = line.substr(0, line.find(" = "));
    const bool is_of_output = std::find(kKeysOfOutput.begin(), kKeysOfOutput.end(), key) != kKeysOfOutput.end();
    if (!is_of_output && !line.starts_with('#')) settings += line + '\n';
  }
  return settings;
}

void apply_settings(const std::string& settings, const std::string& name, CLI::App& verb) {
  apply_config(read_toml_config(name, settings), verb);
}

bool SavingPace::is_due() const {
  return seconds_now() - saved_ >= std::min(kSecondsBetweenSaves, taken_ / kPartForSaving);
}

void SavingPace::save(const std::function<void()>& how) {
  const double begin = seconds_now();
  how();
  saved_ = seconds_now();
  taken_ = saved_ - begin;
  has_saved_ = true;
}

bool saved_before(const std::filesystem::path& file, bool resume, bool part) {
  const bool exists = is_there(file);
  if (exists && !resume)
    throw InputError(fmt::format("'{}' {}: {} it with --resume, remove the file, or choose another folder",
                                 file.string(), part ? "exists already" : "belongs to an unfinished run",
                                 part ? "continue or keep" : "continue"));
  if (resume && !exists && part)
    print_note(fmt::format("nothing is saved in '{}' yet: this part begins", file.string()));
  return exists;
}

bool is_done_before(const std::filesystem::path& record, const std::string& fingerprint) {
  const Json json = is_file(record) ? Json::parse(read_file(record), nullptr, false) : Json();
  const bool is_done = json.is_object() && json.contains("run") && json["run"] == fingerprint;
  print_note(is_done ? fmt::format("there is nothing left to do: '{}' has the results of this run", record.string())
                     : fmt::format("nothing is saved in '{}' yet: the run begins", record.parent_path().string()));
  return is_done;
}

void remove_saved(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error) print_warning(fmt::format("'{}' cannot be removed: {}", file.string(), error.message()));
}

records::UnitRun read_saved(const std::filesystem::path& file) {
  return records::read_unit_part(read_file(file), file.string());
}

UnitJob::UnitJob(const std::string& verb, const UnitOptions& options, const OutputOptions& output,
                 const std::string& record, const std::function<void()>& check_outputs)
    : verb_(verb), asked_to_resume_(options.resume), record_(output.file(record)) {
  if (!options.shard.empty()) shard_ = parse_shard(options.shard);
  const bool is_shard = shard_.count > 1;
  file_ = output.file(is_shard ? fmt::format("part-{}-of-{}.{}", shard_.index, shard_.count, verb) : verb + ".partial");
  if (!ranks::is_first()) return;
  if (is_shard)
    output.check_only(file_.filename().string());
  else
    check_outputs();
  if (!is_shard) check_result_file(file_, "--out");
  resumes_ = saved_before(file_, options.resume, is_shard);
}

void UnitJob::resume() { resume_units(run_, read_saved(file_), file_.string()); }

void UnitJob::save() const { write_file_atomically(file_, unit_part(run_)); }

void UnitJob::run(records::UnitRun run, const std::function<Json(int)>& work, const std::string& what) {
  run_ = std::move(run);
  run_.verb = verb_;
  run_.shard = shard_;
  run_.threads = thread_count() * ranks::size();
  if (shard_.count > run_.units)
    throw InputError(fmt::format("--shard asks for {} parts, and there are {} {}", shard_.count, run_.units, what));
  if (resumes_) resume();
  if (asked_to_resume_ && shard_.count == 1) {
    const bool is_done = ranks::is_first() && !resumes_ && is_done_before(record_, unit_fingerprint(run_));
    done_before_ = ranks::gather(is_done ? "1" : "") == "1";
    if (done_before_) return;
  }
  const Interrupt interrupt;
  Progress progress;
  const double begin = seconds_now();
  const double before = run_.seconds;
  SavingPace pace;
  const std::vector<int> own = run_.own_units();
  std::size_t next = 0;
  ranks::share<int, Json>(
      {.next = [&]() -> std::optional<int> {
         while (next < own.size() && run_.results.contains(own[next])) ++next;
         if (next == own.size()) return std::nullopt;
         return own[next++];
       },
       .work = [&](const int& unit) { return work(unit); },
       .take =
           [&](const int& unit, Json result) {
             run_.results.emplace(unit, std::move(result));
             run_.seconds = before + seconds_now() - begin;
             progress.show(static_cast<double>(run_.results.size()) / static_cast<double>(own.size()),
                           fmt::format("{} of {} {}", run_.results.size(), own.size(), what));
             if (pace.is_due()) pace.save([&] { save(); });
           },
       .to_bytes =
           [](const Json& result) {
             const std::vector<std::uint8_t> bytes = Json::to_cbor(result);
             return std::string(bytes.begin(), bytes.end());
           },
       .of_bytes = [](std::string_view bytes) { return Json::from_cbor(bytes.begin(), bytes.end()); }});
  if (ranks::is_first() && (run_.partial() || pace.has_saved() || run_.shard.count > 1)) save();
}

bool UnitJob::is_whole(const OutputOptions& output, const std::string& what) const {
  if (!ranks::is_first() || done_before_) return false;
  const bool is_shard = run_.shard.count > 1;
  if (!is_shard && !run_.partial()) return true;
  const std::size_t own = run_.own_units().size();
  if (is_shard && output.prints())
    print_text("part {} of {}: {} of its {} {} in {}\n", run_.shard.index, run_.shard.count, run_.results.size(), own,
               what, file_.string());
  if (run_.partial())
    print_warning(fmt::format("partial: {} of {} {} are saved in '{}'; continue with --resume", run_.results.size(),
                              own, what, file_.string()));
  return false;
}

int UnitJob::exit_code() const { return ranks::is_first() && run_.partial() && !done_before_ ? kNotConverged : kDone; }

}  // namespace pulson
