#include "arguments.hpp"

#include "shell/help_groups.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"

namespace pulson {

void ViewArguments::add_to(CLI::App& verb) {
  reads_file(
      verb.add_option("FILES", files,
                      "pictures (png, jpg, tif, …), landmark files whose pictures are beside them, or the "
                      "NAME.pulson.json of an earlier session; none: pictures are dropped onto the page; or a folder "
                      "of results, whose shapes are opened, or else whose report"));
  verb.add_flag("--no-browser", no_browser, "only print the address of the page");
  verb.add_option("--port", port, "of 127.0.0.1 [any that is free]")->type_name("N")->check(CLI::Range(0, 65535));
  verb.add_flag("--in-place", in_place,
                "exporting may replace the landmark file that was opened; its first state is kept as NAME.first.EXT");
  add_max_pixels_option(verb, max_pixels);
  begin_group(verb, more(kInputGroup));
  add_read_options(verb, reading);
  add_flip_option(verb, reading);
  add_quiet_option(verb);
}

}  // namespace pulson
