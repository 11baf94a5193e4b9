# Generates page_files.cc, which embeds the files of the viewer's page and three.js; sets page_files_source to its path. The
# assembler includes the files (.incbin), so their half megabyte adds no compile time.
find_path(HULLD_THREE_JS three.min.js PATHS /usr/share/javascript/three NO_DEFAULT_PATH
          DOC "Directory of three.js (Debian: libjs-three)")
if(NOT HULLD_THREE_JS)
  message(FATAL_ERROR "three.js not found (the page of 'hullctl view' uses it): install libjs-three, or pass its directory "
                      "with -DHULLD_THREE_JS=DIR")
endif()

# hulld_embed_page(NAME FILE): embeds a file under the name used by the page.
function(hulld_embed_page name file)
  string(MAKE_C_IDENTIFIER hulld_page_${name} symbol)
  set(page_symbols "${page_symbols}HULLD_EMBED(${symbol}, \"${file}\")\n" PARENT_SCOPE)
  set(page_rows "${page_rows}    {\"${name}\", Between(${symbol}, ${symbol}_end)},\n" PARENT_SCOPE)
  set(page_inputs ${page_inputs} ${file} PARENT_SCOPE)
endfunction()

set(page_symbols "")
set(page_rows "")
set(page_inputs "")
cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH page_folder)
cmake_path(APPEND page_folder page)
file(GLOB_RECURSE page_names CONFIGURE_DEPENDS RELATIVE ${page_folder}
     ${page_folder}/*.html ${page_folder}/*.css ${page_folder}/*.js)
foreach(name ${page_names})
  hulld_embed_page(${name} ${page_folder}/${name})
endforeach()
hulld_embed_page(three/three.min.js ${HULLD_THREE_JS}/three.min.js)
foreach(controls OrbitControls TransformControls)
  hulld_embed_page(three/${controls}.js ${HULLD_THREE_JS}/examples/js/controls/${controls}.js)
endforeach()

set(page_files_source ${CMAKE_CURRENT_BINARY_DIR}/page_files.cc)
configure_file(${CMAKE_CURRENT_LIST_DIR}/page_files.cc.in ${page_files_source} @ONLY)
# ccache detects .incbin and recompiles; the build system must know the inputs. Compiled alone, so that a change of the page
# recompiles nothing else.
set_source_files_properties(${page_files_source} PROPERTIES OBJECT_DEPENDS "${page_inputs}" SKIP_PRECOMPILE_HEADERS ON
                            SKIP_UNITY_BUILD_INCLUSION ON)
