#include "collada_nodes.h"
#include "formats.h"
#include "xml_tags.h"

namespace adaptive_bvh {
namespace {

std::string findElementError(const std::string& text) {
  ColladaNodes nodes;
  XmlTags tags(text);
  for (auto kind = tags.next(); kind != XmlTags::None; kind = tags.next()) {
    if (kind == XmlTags::Type) {
      if (tags.tag().find('[') != text.npos) return "its document type has declarations";
      continue;
    }
    if (kind != XmlTags::End) nodes.enter(tags.tag());
    if (nodes.levels() > kMostLevels)
      return "its elements are nested in more than " + std::to_string(kMostLevels) + " levels";
    if (kind != XmlTags::Start) nodes.leave();
  }
  return nodes.findError();
}

}  // namespace

std::string findXmlError(const std::string& text) {
  if (text.find('\0') != text.npos) return "its text is not in UTF-8";
  const std::string error = findElementError(text);
  return error.empty() && text.find("<COLLADA") != text.npos ? findColladaDataError(text) : error;
}

}  // namespace adaptive_bvh
