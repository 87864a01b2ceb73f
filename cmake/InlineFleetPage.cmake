# cmake -D WEB=web -D BUNDLE=bundle.js -D OUTPUT=page.html -P InlineFleetPage.cmake
# makes one file of the fleet page: web/fleet/index.html with its style sheets, and its script as esbuild bundled it. What
# {{data}} and {{history}} stand for, trundle.fleet fills in.
cmake_minimum_required(VERSION 3.25)
file(READ ${WEB}/fleet/index.html page)
foreach(sheet IN ITEMS ../style.css fleet.css)
  file(READ ${WEB}/fleet/${sheet} style)
  string(REPLACE "<link rel=\"stylesheet\" href=\"${sheet}\">" "<style>\n${style}</style>" page "${page}")
endforeach()
file(READ ${BUNDLE} bundle)
string(REPLACE "<script type=\"module\" async src=\"main.js\"></script>"
       "<script type=\"module\" async>\n${bundle}</script>" page "${page}")
file(WRITE ${OUTPUT} "${page}")
