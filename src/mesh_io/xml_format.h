#pragma once

#include <string>

namespace adaptive_bvh {

/// As assimp sees it: no vertical tabs or form feeds.
inline bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// What is wrong with the elements of an XML text before assimp may read it; empty when nothing is:
/// too many levels, declarations that could hide elements, or the nodes of a Collada scene are no
/// hierarchy by `findHierarchyError`, those included that instance each other.
std::string findXmlError(const std::string& text);

}  // namespace adaptive_bvh
