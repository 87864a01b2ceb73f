# cmake -D WEB=web -D BUNDLE=bundle.js -D OUTPUT=page_template.cpp -P InlinePage.cmake
# makes one string of the report page: index.html with its style sheets, its script with all that it imports as esbuild
# bundled them, and the vendored script with its licence.
cmake_minimum_required(VERSION 3.25)

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
file(READ ${BUNDLE} bundle)
string(REPLACE "<link rel=\"stylesheet\" href=\"vendor/uPlot/uPlot.min.css\">" "<style>\n${vendored_style}\n</style>" page "${page}")
string(REPLACE "<link rel=\"stylesheet\" href=\"style.css\">" "<style>\n${style}</style>" page "${page}")
string(REPLACE "<script src=\"vendor/uPlot/uPlot.iife.min.js\"></script>" "<script>\n${vendored_script}</script>" page "${page}")
string(REPLACE "<script type=\"module\" src=\"main.js\"></script>"
       "<script type=\"module\">\n${bundle}</script>" page "${page}")
file(WRITE ${OUTPUT} "// Made from web/ by cmake/InlinePage.cmake.
#include \"trundle/report/page.hpp\"

namespace trundle::report {

std::string_view page_template() { return R\"trundle_page(${page})trundle_page\"; }

}  // namespace trundle::report
")
