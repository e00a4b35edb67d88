// `pulson view`: a page on which landmarks are placed on pictures, and the map between them is seen.

#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

#include <fmt/format.h>

#include "arguments.hpp"
#include "core/paths.hpp"
#include "draw/child_process.hpp"
#include "pulson/core/errors.hpp"
#include "requests.hpp"
#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/printing.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"
#include "specimens.hpp"

namespace pulson {
namespace {

bool has_screen() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"})
    if (const char* value = std::getenv(name); value != nullptr && *value != '\0') return true;
  return false;
}

// Opens the page where a browser can be had. The program that opens it may be the browser itself, so it is left to run:
// its object is not destroyed.
void open_browser(const std::string& url) {
  const std::filesystem::path opener = draw::find_program("xdg-open");
  if (opener.empty() || !has_screen()) {
    print_note("there is no browser to open here: open the address above in one");
    return;
  }
  try {
    [[maybe_unused]] const auto* kept = new draw::ChildProcess(opener, {url});
  } catch (const InputError& error) {
    print_note(fmt::format("the browser cannot be opened ({}): open the address above in one", error.what()));
  }
}

// The page that a verb wrote beside its results.
void open_report(const ViewedResults& results, const std::string& folder, bool opens) {
  if (results.report.empty())
    throw InputError(fmt::format("{} has no report.html: it is no folder of results, or of a verb that makes no page",
                                 quoted_path(folder)));
  print_text("{}\n", results.report.string());
  if (!results.why.empty())
    print_note(fmt::format("its report is opened, landmarks cannot be placed again: {}", results.why));
  if (opens) open_browser(results.report.string());
}

void run_view(const ViewArguments& arguments) {
  const bool is_of_results = arguments.files.size() == 1 && is_folder(arguments.files.front());
  const ViewedResults results =
      is_of_results ? results_of(arguments.files.front(), arguments.reading) : ViewedResults{};
  if (is_of_results && results.shapes.empty())
    return open_report(results, arguments.files.front(), !arguments.no_browser);
  const ViewFiles files = is_of_results ? ViewFiles(results) : ViewFiles(arguments);
  view::SavedDocument document(files.document);
  std::vector<std::string> notes;
  open_session(files, arguments, document, notes);
  PageRequests requests(document, arguments, results.report);
  view::LocalServer server(
      arguments.port, [&](const view::Request& request) { return requests.answer(request); },
      [](std::string_view path) { return PageRequests::most_bytes(path); });
  const Interrupt until_ended;
  server.start();
  print_text("{}\n", server.url());
  print_notes(without_repeats(notes));
  print_note(fmt::format("everything is kept in {}; Ctrl-C ends it", document.path().string()));
  if (!arguments.no_browser) open_browser(server.url());
  if (const std::string fault = fault_of_standard_output(); !fault.empty()) throw InputError(fault);
  while (!Interrupt::came() && !requests.is_over()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

}  // namespace

void add_view_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("view", "Place landmarks on pictures and see the map, on a page");
  auto arguments = std::make_shared<ViewArguments>();
  arguments->add_to(*verb);
  verb->footer(
      "The page is served on this machine alone, at an address that nobody can guess. Each\n"
      "change is saved at once in NAME.pulson.json beside the first file; the same command\n"
      "goes on from there.\n"
      "Examples:\n"
      "  pulson view leaf_1.png leaf_2.png\n"
      "  pulson view wings.tps\n"
      "  pulson view out   (of register, compare, sample or atlas: their shapes, with the report)\n"
      "Exit codes: 0 done, 2 bad input.");
  verb->callback([arguments] { run_view(*arguments); });
}

}  // namespace pulson
