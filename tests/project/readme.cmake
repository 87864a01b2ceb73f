# README.md shows what the commands really print: the demo's table, and how many tests there are.
# cmake -DROOT=<checkout> -DBINARY_DIR=<build tree with the program> -DALL_TESTS=<whether it has them all> -P readme.cmake
cmake_minimum_required(VERSION 3.25)
file(READ ${ROOT}/README.md readme)
function(require_in_readme text what)
  string(FIND "${readme}" "${text}" place)
  if(place EQUAL -1)
    message(FATAL_ERROR "README.md does not show ${what}:\n${text}")
  endif()
endfunction()

execute_process(COMMAND bash tools/demo.sh ${BINARY_DIR}/trundle data/demo ${BINARY_DIR}/readme_demo
                WORKING_DIRECTORY ${ROOT} OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
string(REGEX REPLACE "\nResults: .*" "" table "${printed}")
require_in_readme("${table}" "what ./run demo prints")

if(NOT ALL_TESTS)
  return()
endif()
execute_process(COMMAND ${CMAKE_CTEST_COMMAND} -N WORKING_DIRECTORY ${BINARY_DIR} OUTPUT_VARIABLE listed
                COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCH "Total Tests: ([0-9]+)" matched "${listed}")
require_in_readme("100% tests passed, 0 tests failed out of ${CMAKE_MATCH_1}\n" "the summary of ./run test")
