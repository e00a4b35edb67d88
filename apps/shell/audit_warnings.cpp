#include "audit_warnings.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "formats/shape_address.hpp"
#include "messages.hpp"
#include "program.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {
namespace {

// The verb with the files of these shapes, of many the first.
std::string audit_command(const std::vector<Landmarks>& shapes) {
  constexpr std::size_t kMostFiles = 2;
  std::vector<std::string> files;
  for (const Landmarks& shape : shapes)
    if (std::string file = shell_word(formats::file_of_address(shape.source)); files.empty() || file != files.back())
      files.push_back(std::move(file));
  const bool are_many = files.size() > kMostFiles;
  files.resize(std::min(files.size(), kMostFiles));
  return fmt::format("pulson audit {}{}", fmt::join(files, " "), are_many ? " …" : "");
}

}  // namespace

std::string pair_warning(const Landmarks& reference, const Landmarks& shape, std::vector<std::string>& notes) {
  const std::vector<audit::Finding> findings = audit::audit_pair(reference, shape).findings;
  if (findings.empty() || findings.front().problem == audit::Problem::kMirrored) return {};
  const audit::Finding& found = findings.front();
  if (found.problem == audit::Problem::kReversed)
    std::erase_if(notes, [](const std::string& note) { return note.starts_with("the shapes look mirrored"); });
  return fmt::format("{}: {}; pulson audit {} {}", shape.source, describe(found, shape), reference.source,
                     shape.source);
}

void warn_of_cohort(std::vector<Landmarks> shapes) {
  if (shapes.empty()) return;
  const int count = shapes.front().count();
  std::erase_if(shapes, [count](const Landmarks& shape) { return shape.count() != count; });
  warn_of_findings(shapes, audit::audit_cohort(shapes));
}

void warn_of_findings(const std::vector<Landmarks>& shapes, const audit::Audit& audit) {
  constexpr std::size_t kMost = 10;
  const std::vector<audit::Finding>& found = audit.findings;
  for (std::size_t i = 0; i < std::min(found.size(), kMost); ++i) {
    const Landmarks& shape = shapes[static_cast<std::size_t>(found[i].specimen)];
    print_warning(fmt::format("specimen {} ({}): {}; {}", quoted_line(shape.name), shape.source,
                              describe(found[i], shape), audit_command(shapes)));
  }
  if (found.size() > kMost)
    print_warning(
        fmt::format("landmarks of {} more specimens look wrong; {}", found.size() - kMost, audit_command(shapes)));
}

}  // namespace pulson
