# trundle_inline_page(TARGET) compiles web/ into a target as one string: see InlinePage.cmake.
function(trundle_inline_page target)
  set(web ${PROJECT_SOURCE_DIR}/web)
  set(script ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/InlinePage.cmake)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/page_template.cpp)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${web}/*.html ${web}/*.css ${web}/*.js)
  add_custom_command(OUTPUT ${output} DEPENDS ${sources} ${script} COMMENT "Inlining web/ into the report page"
                     COMMAND ${CMAKE_COMMAND} -D WEB=${web} -D OUTPUT=${output} -P ${script} VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()
