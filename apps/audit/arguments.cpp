#include "arguments.hpp"

#include "shell/help_groups.hpp"
#include "shell/path_options.hpp"
#include "shell/tables.hpp"

namespace pulson {

void AuditArguments::add_to(CLI::App& verb) {
  reads_shape(
      verb.add_option("FILES", files,
                      "one or more landmark files: of two shapes the second is judged by the first, of 5 or more "
                      "each by the others"))
      ->required();
  add_read_options(verb, reading);
  add_order_option(verb, by_order);
  output.add_files_to(verb);
  writes_file(verb.add_option("--fix", fix,
                              "write a copy of FILES without the errors that were found and can be mended; of several "
                              "files FOLDER/, for copies of the same names"));
  reads_column(verb.add_option("--repeats", repeats,
                               "measure the error of digitising from specimens digitised more than once: a column of a "
                               "csv file, or a comment of the shapes, that says of which specimen each is; names: "
                               "shapes of one name are of one"));
  add_flip_option(verb, reading);
  begin_group(verb, kPictureGroup);
  verb.add_flag("--no-picture", output.no_picture, "do not draw accused specimens on the page");
  begin_group(verb, more(kInputGroup));
  add_table_option(verb);
  add_quiet_option(verb);
}

}  // namespace pulson
