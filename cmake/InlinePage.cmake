# cmake -D WEB=web -D OUTPUT=page_template.cpp -P InlinePage.cmake
# makes one string of the report page: index.html with its style sheet and all modules that its script imports.
cmake_minimum_required(VERSION 3.25)

# Appends a module, after the modules it imports, to the property `bundle` unless it is in it. Each becomes a function
# with a scope of its own:   import { a } from './b.js';  ->  const { a } = modules['b.js'];
# Imports stand on one line each; exports are functions and constants.
function(append_module path)
  file(RELATIVE_PATH name ${WEB} ${path})
  get_property(seen GLOBAL PROPERTY seen_modules)
  if(name IN_LIST seen)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY seen_modules ${name})
  file(READ ${path} text)
  string(REGEX MATCHALL "import [^\n]* from '[^'\n]+'" imports "${text}")
  get_filename_component(folder ${path} DIRECTORY)
  foreach(import IN LISTS imports)
    string(REGEX MATCH "'([^']+)'" quoted "${import}")
    get_filename_component(imported ${folder}/${CMAKE_MATCH_1} ABSOLUTE)
    append_module(${imported})
    file(RELATIVE_PATH imported_name ${WEB} ${imported})
    string(REPLACE "from ${quoted}" "= modules['${imported_name}']" destructured "${import}")
    string(REGEX REPLACE "^import " "const " destructured "${destructured}")
    string(REPLACE "${import}" "${destructured}" text "${text}")
  endforeach()
  string(REGEX MATCHALL "\nexport [a-z]+ [A-Za-z0-9]+" exports "${text}")
  list(TRANSFORM exports REPLACE ".* " "")
  list(JOIN exports ", " exports)
  string(REGEX REPLACE "\nexport " "\n" text "${text}")
  set_property(GLOBAL APPEND_STRING PROPERTY bundle
               "\nmodules['${name}'] = (() => {\n${text}return { ${exports} };\n})();\n")
endfunction()

file(READ ${WEB}/index.html page)
file(READ ${WEB}/style.css style)
append_module(${WEB}/main.js)
get_property(bundle GLOBAL PROPERTY bundle)
string(REPLACE "<link rel=\"stylesheet\" href=\"style.css\">" "<style>\n${style}</style>" page "${page}")
string(REPLACE "<script type=\"module\" src=\"main.js\"></script>"
       "<script type=\"module\">\nconst modules = {};\n${bundle}</script>" page "${page}")
file(WRITE ${OUTPUT} "// Made from web/ by cmake/InlinePage.cmake.
#include \"trundle/report/page.hpp\"

namespace trundle {

std::string_view page_template() { return R\"trundle_page(${page})trundle_page\"; }

}  // namespace trundle
")
