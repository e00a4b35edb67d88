#pragma once

// A specification of every noise model.

#include <string>
#include <vector>

#include "pulson/noise/noise_table.hpp"

namespace pulson {

/// Every row with numbers for what must be given, alone and with `on` and `common` where it knows them; then their sum.
inline std::vector<std::string> rows_and_their_sum() {
  std::vector<std::string> specs;
  std::string sum;
  for (const auto& row : noise_table().rows()) {
    std::string text;
    std::vector<std::string> choices{""};
    for (const ParameterInfo& parameter : row.parameters) {
      if (parameter.default_text.empty()) text += "," + parameter.name + (text.empty() ? "=0.7" : "=0.9");
      if (parameter.name != "on" && parameter.name != "common") continue;
      const std::string choice = parameter.name == "on" ? ",on=1/3/5" : ",common=1";
      for (std::size_t i = choices.size(); i-- > 0;) choices.push_back(choices[i] + choice);
    }
    for (const std::string& choice : choices) {
      std::string all = text + choice;
      if (!all.empty()) all.front() = ':';
      specs.push_back(row.name + all);
    }
    sum += (sum.empty() ? "" : "+") + specs.back();
  }
  specs.push_back(sum);
  return specs;
}

}  // namespace pulson
