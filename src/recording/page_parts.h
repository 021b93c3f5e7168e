#pragma once

#include <string_view>

namespace adaptive_bvh {

/// \name Files that are part of every page, as they were when the library was built
/// \{
std::string_view pageTemplate();  ///< page.html: {{...}} stands for what follows, and for the run
std::string_view pageStyle();     ///< page.css
std::string_view pageScript();    ///< all of page/*.js, one after the other
std::string_view threeScript();   ///< three.js
/// \}

}  // namespace adaptive_bvh
