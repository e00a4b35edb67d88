# pulson_embed_text(<target> <name> FILES <files...>): gives <target> the header <name>.hpp, made when CMake runs, which a change
# of a file causes. It holds each file's text as a `constexpr std::string_view` in the namespace pulson::<name>, `report.css` as
# `report_css`.
function(pulson_embed_text target name)
  cmake_parse_arguments(ARG "" "" "FILES" ${ARGN})
  set(header "#pragma once\n\n#include <string_view>\n\nnamespace pulson::${name} {\n")
  string(APPEND header "\n// NOLINTBEGIN(readability-identifier-naming): they have the files' names\n")
  foreach(file IN LISTS ARG_FILES)
    get_filename_component(variable ${file} NAME)
    string(MAKE_C_IDENTIFIER ${variable} variable)
    file(READ ${file} text)
    string(APPEND header "\ninline constexpr std::string_view ${variable} = R\"text(${text})text\";\n")
  endforeach()
  string(APPEND header "\n// NOLINTEND(readability-identifier-naming)\n}  // namespace pulson::${name}\n")
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}_embedded)
  file(CONFIGURE OUTPUT ${folder}/${name}.hpp CONTENT "@header@" @ONLY)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${ARG_FILES})
  target_include_directories(${target} PRIVATE ${folder})
endfunction()
