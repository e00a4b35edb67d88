# Installs BUILD to WORK/prefix by way of another folder: what is found there owes nothing to where it was installed.
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
file(RENAME ${WORK}/first ${WORK}/prefix)

file(GLOB_RECURSE scripts ${WORK}/prefix/*.cmake)
foreach(script IN LISTS scripts)
  file(STRINGS ${script} lines)
  foreach(place ${SOURCE} ${BUILD})
    if("${lines}" MATCHES "${place}")
      message(FATAL_ERROR "${script} refers to ${place}")
    endif()
  endforeach()
endforeach()
