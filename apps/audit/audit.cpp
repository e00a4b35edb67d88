// `pulson audit`: which landmarks and specimens are wrong, and how.

#include <memory>

#include <fmt/format.h>

#include "arguments.hpp"
#include "core/atomic_file.hpp"
#include "mend.hpp"
#include "pulson/core/errors.hpp"
#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"
#include "shell/run_results.hpp"
#include "shell/specimen_columns.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

std::vector<AuditedFile> read_files(const AuditArguments& arguments, std::vector<std::string>& notes) {
  std::vector<AuditedFile> files;
  std::size_t first = 0;
  for (const std::string& address : arguments.files) {
    files.push_back({address, read_addressed_shapes(address, arguments.reading), first});
    const formats::LandmarkFile& read = files.back().contents;
    log_step(fmt::format("read {}: {}", address, read.format));
    notes.insert(notes.end(), read.warnings.begin(), read.warnings.end());
    first += read.shapes.size();
  }
  return files;
}

void check_audit_outputs(const OutputOptions& output, bool with_repeats) {
  if (!output.out.empty())
    output.check(with_repeats ? std::vector<std::string>{"audit.json", "audit.csv", "covariances.csv", "report.html"}
                              : std::vector<std::string>{"audit.json", "audit.csv", "report.html"},
                 {});
  else if (!output.json.empty() && output.json != "-")
    check_output_file(output.json);
}

// Numbers, then the mended files, then the page.
void write_audit(const AuditArguments& arguments, const AuditResults& results, const MendedFiles* mended) {
  const OutputOptions& output = arguments.output;
  if (output.out.empty()) {
    const Interrupt until_written;
    if (mended != nullptr) mended->write();
    return output.write_json(audit_json(results));
  }
  RunResults staged(output);
  staged.add("audit.csv", findings_csv(results));
  if (results.repeats) staged.add("covariances.csv", covariances_csv(results));
  staged.commit("audit.json", audit_json(results));
  if (mended != nullptr) staged.write_outside([&] { mended->write(); });
  staged.add_page([&] { return audit_report(results, !output.no_picture); });
  staged.finish();
  if (output.prints()) staged.print_written();
}

// Of the shapes in which nothing looks wrong and nothing is missing: one gross error would be taken for all of them.
void measure_repeats(const AuditArguments& arguments, AuditResults& results) {
  std::vector<bool> is_left_out(results.shapes.size(), false);
  for (const audit::Finding& finding : results.audit.findings)
    is_left_out[static_cast<std::size_t>(finding.specimen)] = true;
  std::vector<Landmarks> shapes;
  for (std::size_t i = 0; i < results.shapes.size(); ++i)
    if (!is_left_out[i] && results.shapes[i].shape.points.allFinite()) shapes.push_back(results.shapes[i].shape);
  if (shapes.empty()) throw InputError("--repeats: no shape is complete and without a finding");
  std::vector<std::string> specimens;
  if (arguments.repeats == "names")
    for (const Landmarks& shape : shapes) specimens.push_back(shape.name);
  else
    specimens = groups_of({arguments.repeats, "--repeats", arguments.by_order}, shapes, results.notes);
  if (shapes.size() < results.shapes.size())
    results.notes.push_back(fmt::format("--repeats: {} of {} shapes, which look wrong or miss landmarks, are left out",
                                        results.shapes.size() - shapes.size(), results.shapes.size()));
  results.repeats = audit::repeatability(shapes, specimens);
}

void run_audit(const AuditArguments& arguments) {
  std::vector<std::string> notes;
  std::vector<AuditedFile> files = read_files(arguments, notes);
  check_audit_outputs(arguments.output, !arguments.repeats.empty());
  AuditResults results = judge_shapes(shapes_of(files), arguments.by_order);
  log_step(fmt::format("judged {}", counted(results.judged_count(), "shape")));
  if (!arguments.repeats.empty()) measure_repeats(arguments, results);
  results.notes.insert(results.notes.begin(), notes.begin(), notes.end());
  results.notes = without_repeats(results.notes);
  std::unique_ptr<MendedFiles> mended;
  std::vector<std::string> losses;
  if (!arguments.fix.empty()) {
    mended = std::make_unique<MendedFiles>(arguments.fix, files, results);
    mended->mend(std::move(files), results, losses);
  }
  print_notes(in_option_words(results.notes));
  print_notes(losses);
  if (arguments.output.prints()) print_audit(results);
  write_audit(arguments, results, mended.get());
  if (mended && arguments.output.prints()) mended->print(results);
}

}  // namespace

void add_audit_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("audit", "Find wrong landmarks and specimens, and mend them");
  auto arguments = std::make_shared<AuditArguments>();
  arguments->add_to(*verb);
  verb->footer(
      "Files stay as they are; --fix writes a copy.\n"
      "Examples:\n"
      "  pulson audit skulls.tps\n"
      "  pulson audit skulls.tps -o out --fix mended.tps\n"
      "  pulson audit reference.csv specimen.csv\n"
      "Exit codes: 0 done, whatever is found, 2 bad input.");
  verb->callback([arguments] { run_audit(*arguments); });
}

}  // namespace pulson
