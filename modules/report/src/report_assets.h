#pragma once

#include <string_view>

namespace etalon::report_assets {

// Files of modules/report/page and of the charting library, embedded at build time.
std::string_view benchmarkPage();  ///< benchmark.html, with {{name}} where a text is inserted
std::string_view runPage();        ///< run.html, in the same way
std::string_view trialPage();
std::string_view style();            ///< report.css
std::string_view benchmarkScript();  ///< the page's own scripts, one after the other
std::string_view runScript();
std::string_view trialScript();
std::string_view library();   ///< echarts.min.js
std::string_view licences();  ///< of the library and of what it contains

}  // namespace etalon::report_assets
