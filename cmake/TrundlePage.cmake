# Stops where a vendored file is not the one that was checked in.
function(trundle_check_vendored folder)
  file(STRINGS ${folder}/SHA256SUMS lines)
  foreach(line IN LISTS lines)
    string(REGEX MATCH "^([0-9a-f]+)  (.+)$" matched "${line}")
    set(expected ${CMAKE_MATCH_1})
    set(file ${folder}/${CMAKE_MATCH_2})
    file(SHA256 ${file} found)
    if(NOT found STREQUAL expected)
      message(FATAL_ERROR "${file} has SHA-256 ${found}; expected ${expected}")
    endif()
  endforeach()
endfunction()

find_program(ESBUILD esbuild REQUIRED)

# trundle_inline_page(TARGET) compiles web/ into a target as one string: see InlinePage.cmake.
function(trundle_inline_page target)
  set(web ${PROJECT_SOURCE_DIR}/web)
  set(script ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/InlinePage.cmake)
  set(bundle ${CMAKE_CURRENT_BINARY_DIR}/page.js)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/page_template.cpp)
  trundle_check_vendored(${web}/vendor/uPlot)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${web}/*.html ${web}/*.css ${web}/*.js)
  add_custom_command(OUTPUT ${output} DEPENDS ${sources} ${script} WORKING_DIRECTORY ${web}
                     COMMENT "Inlining web/ into the report page"
                     COMMAND ${ESBUILD} main.js --bundle --format=esm --charset=utf8 --log-level=warning
                             --outfile=${bundle}
                     COMMAND ${CMAKE_COMMAND} -D WEB=${web} -D BUNDLE=${bundle} -D OUTPUT=${output} -P ${script} VERBATIM)
  set_source_files_properties(${output} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON
                              COMPILE_OPTIONS -Wno-overlength-strings)  # compilers here manage more than the standard asks
  target_sources(${target} PRIVATE ${output})
endfunction()
