# etalon_embed_report(TARGET): the report's front end becomes part of the library, as src/report_assets.h hands it out.
# Files that are given out as one are joined here; joined files are made anew when one of their parts changes.
function(etalon_embed_report target)
  set(sources "${CMAKE_CURRENT_SOURCE_DIR}/page")
  set(modules "${sources}/node_modules")
  if(NOT EXISTS "${modules}/echarts/dist/echarts.min.js")
    message(
      FATAL_ERROR
        "The charting library of the HTML report is missing: ${modules}/echarts/dist/echarts.min.js\n"
        "Run scripts/install_dependencies.sh, or: npm ci --omit=dev --prefix ${sources}")
  endif()
  foreach(page IN ITEMS benchmark run trial)
    set(${page}_page_parts "${sources}/head.html" "${sources}/${page}.html" "${sources}/foot.html")
  endforeach()
  set(style_parts "${sources}/report.css")
  set(benchmark_script_parts common theme data charts timeline panel lists main)
  set(run_script_parts common theme run)
  set(trial_script_parts common theme trial)
  foreach(script IN ITEMS benchmark_script run_script trial_script)
    list(TRANSFORM ${script}_parts REPLACE "(.+)" "${sources}/\\1.js")
  endforeach()
  set(library_parts "${modules}/echarts/dist/echarts.min.js")
  set(licences_parts "${sources}/licences.txt" "${modules}/echarts/NOTICE" "${modules}/echarts/LICENSE"
                     "${modules}/echarts/licenses/LICENSE-d3" "${modules}/zrender/LICENSE")
  set(asset_folder "${CMAKE_CURRENT_BINARY_DIR}/report")
  set(assets)
  foreach(asset IN ITEMS benchmark_page run_page trial_page style benchmark_script run_script trial_script library licences)
    add_custom_command(
      OUTPUT "${asset_folder}/${asset}"
      COMMAND ${CMAKE_COMMAND} -E cat ${${asset}_parts} > "${asset_folder}/${asset}"
      DEPENDS ${${asset}_parts}
      COMMENT "Joining the report's ${asset}"
      VERBATIM)
    list(APPEND assets "${asset_folder}/${asset}")
  endforeach()
  set(generated "${asset_folder}/report_assets.cpp")
  configure_file("${sources}/report_assets.cpp.in" "${generated}" @ONLY)
  # In a unity build it would lose what it depends on, and pages that are changed would not be embedded anew.
  set_source_files_properties("${generated}" PROPERTIES OBJECT_DEPENDS "${assets}" SKIP_UNITY_BUILD_INCLUSION ON)
  target_sources(${target} PRIVATE "${generated}")
  target_include_directories(${target} PRIVATE src)
endfunction()
