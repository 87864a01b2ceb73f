# cmake -D WEB=web -D OUTPUT=page_template.cpp -P InlinePage.cmake
# makes one string of the report page: index.html with its style sheets, all modules that its script imports, and the
# vendored script with its licence.
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
  string(REGEX MATCHALL "\nexport (async )?[a-z]+ [A-Za-z0-9]+" exports "${text}")
  list(TRANSFORM exports REPLACE ".* " "")
  list(JOIN exports ", " exports)
  string(REGEX REPLACE "\nexport " "\n" text "${text}")
  set_property(GLOBAL APPEND_STRING PROPERTY bundle
               "\nmodules['${name}'] = (() => {\n${text}return { ${exports} };\n})();\n")
endfunction()

# The script without its first line, which names an address; its licence stands there instead.
function(read_vendored path result)
  file(READ ${path} script)
  string(FIND "${script}" "\n" end)
  math(EXPR start "${end} + 1")
  string(SUBSTRING "${script}" ${start} -1 script)
  get_filename_component(folder ${path} DIRECTORY)
  file(READ ${folder}/LICENSE licence)
  get_filename_component(name ${folder} NAME)
  set(${result} "/* ${name}\n${licence}*/\n${script}" PARENT_SCOPE)
endfunction()

file(READ ${WEB}/index.html page)
file(READ ${WEB}/style.css style)
set(vendored ${WEB}/vendor/uPlot)
file(READ ${vendored}/uPlot.min.css vendored_style)
read_vendored(${vendored}/uPlot.iife.min.js vendored_script)
append_module(${WEB}/main.js)
get_property(bundle GLOBAL PROPERTY bundle)
string(REPLACE "<link rel=\"stylesheet\" href=\"vendor/uPlot/uPlot.min.css\">" "<style>\n${vendored_style}\n</style>" page "${page}")
string(REPLACE "<link rel=\"stylesheet\" href=\"style.css\">" "<style>\n${style}</style>" page "${page}")
string(REPLACE "<script src=\"vendor/uPlot/uPlot.iife.min.js\"></script>" "<script>\n${vendored_script}</script>" page "${page}")
string(REPLACE "<script type=\"module\" src=\"main.js\"></script>"
       "<script type=\"module\">\nconst modules = {};\n${bundle}</script>" page "${page}")
file(WRITE ${OUTPUT} "// Made from web/ by cmake/InlinePage.cmake.
#include \"trundle/report/page.hpp\"

namespace trundle {

std::string_view page_template() { return R\"trundle_page(${page})trundle_page\"; }

}  // namespace trundle
")
