# One target per folder: the LINK lists of src/*/CMakeLists.txt are the architecture.

# Compiler options that every target of ours shares.
add_library(pulson_options INTERFACE)
target_compile_features(pulson_options INTERFACE cxx_std_20)
target_compile_options(
  pulson_options
  INTERFACE -Wall
            -Wextra
            -Wpedantic
            -Wshadow
            -Wconversion
            -Wno-sign-conversion
            -Wno-restrict # false alarms of g++ 12 on std::string (its bug 105651)
            $<$<BOOL:${PULSON_WARNINGS_AS_ERRORS}>:-Werror>)

# SSSE3 alone is of few machines, and a fifth of the compile time of vector code. In all of our code or in none.
target_compile_definitions(pulson_options INTERFACE HWY_DISABLED_TARGETS=HWY_SSSE3)

# pulson_vector_source(<file>): its loops over axes and rounds must unroll in every preset, but for the sanitizers', which
# take ten minutes over that, and over the checks for undefined behaviour in every vector operation.
function(pulson_vector_source file)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "-fno-sanitize=undefined")
  else()
    set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "-O3")
  endif()
endfunction()

# pulson_library(<folder> SOURCES <files...> [PUBLIC <targets...>] [PRIVATE <targets...>])
# makes the static library pulson_<folder> with the alias pulson::<folder>. PUBLIC: what its headers include; PRIVATE:
# what its .cpp files alone use. Headers of other packages count as system headers.
function(pulson_library folder)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(pulson_${folder} STATIC ${ARG_SOURCES})
  add_library(pulson::${folder} ALIAS pulson_${folder})
  target_include_directories(pulson_${folder} PUBLIC ${PROJECT_SOURCE_DIR}/include)
  target_link_libraries(
    pulson_${folder}
    PUBLIC ${ARG_PUBLIC}
    PRIVATE $<BUILD_INTERFACE:pulson_options> ${ARG_PRIVATE})
endfunction()
