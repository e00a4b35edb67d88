# pulson_embed_text(<target> <name> FILES <files...>): gives <target> the header <name>.hpp, made anew when a file changes.
# It holds each file's text as a `constexpr std::string_view` in the namespace pulson::<name>, `report.css` as `report_css`.
#
# The same file, run as a script, makes the header: cmake -DHEADER=… -DNAMESPACE=… -DFILES=… -P EmbedText.cmake
if(CMAKE_SCRIPT_MODE_FILE)
  set(header "#pragma once\n\n#include <string_view>\n\nnamespace pulson::${NAMESPACE} {\n")
  foreach(file IN LISTS FILES)
    get_filename_component(name ${file} NAME)
    string(MAKE_C_IDENTIFIER ${name} name)
    file(READ ${file} text)
    string(APPEND header "\ninline constexpr std::string_view ${name} = R\"text(${text})text\";\n")
  endforeach()
  file(WRITE ${HEADER} "${header}\n}  // namespace pulson::${NAMESPACE}\n")
  return()
endif()

set(PULSON_EMBED_TEXT ${CMAKE_CURRENT_LIST_FILE})

function(pulson_embed_text target name)
  cmake_parse_arguments(ARG "" "" "FILES" ${ARGN})
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}_embedded)
  list(TRANSFORM ARG_FILES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  add_custom_command(
    OUTPUT ${folder}/${name}.hpp
    COMMAND ${CMAKE_COMMAND} -DHEADER=${folder}/${name}.hpp -DNAMESPACE=${name} "-DFILES=${ARG_FILES}" -P
            ${PULSON_EMBED_TEXT}
    DEPENDS ${ARG_FILES} ${PULSON_EMBED_TEXT}
    VERBATIM)
  target_sources(${target} PRIVATE ${folder}/${name}.hpp)
  target_include_directories(${target} PRIVATE ${folder})
endfunction()
