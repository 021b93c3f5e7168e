// Reads the units that AMF and 3MF files declare.
#include <stdexcept>

#include "formats.h"
#include "tokens.h"
#include "xml.h"
#include "zip.h"

namespace adaptive_bvh {
namespace {

/// The length in metres of a unit of AMF or 3MF. Throws if it is unknown.
double metresOf(const std::string& unit) {
  static constexpr struct {
    const char* name;
    double metres;
  } kUnits[] = {{"micron", 1e-6}, {"millimeter", 1e-3}, {"centimeter", 1e-2}, {"inch", 0.0254},
                {"foot", 0.3048}, {"feet", 0.3048},     {"meter", 1}};
  for (const auto& entry : kUnits)
    if (unit == entry.name) return entry.metres;
  throw std::runtime_error("its unit " + quote(unit) + " is unknown");
}

/// The root element of an XML text, without its content.
XmlElement rootOf(std::string_view text) {
  std::size_t begin = text.find('<');
  const auto beginsWith = [&](std::string_view word) {
    return begin < text.size() && text.substr(begin, word.size()) == word;
  };
  while (beginsWith("<?") || beginsWith("<!"))  // instructions, comments, a document type
    begin = text.find('<', text.find(beginsWith("<!--") ? "-->" : ">", begin));
  const std::size_t end = text.find('>', begin);
  if (end >= text.size()) throw std::runtime_error("its model has no root element");
  const bool is_empty = text[end - 1] == '/';
  return parseXml(std::string(text.substr(begin, end - begin)) + (is_empty ? ">" : "/>"));
}

/// The name of the model file, which a 3MF archive gives in a list of relationships; or empty.
std::string modelOf(const ZipArchive& archive) {
  const auto text = archive.find("_rels/.rels");
  const XmlElement root = text ? parseXml(*text) : XmlElement();
  for (const XmlElement& child : root.children) {
    const std::string target = child.attribute("Target");
    if (root.name == "Relationships" && child.name == "Relationship" &&
        child.attribute("Type") == "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel")
      return target.substr(target.compare(0, 1, "/") == 0 ? 1 : 0);
  }
  return "";
}

}  // namespace

std::optional<double> unitOfAmf(const XmlElement& root) {
  if (root.name != "amf") return std::nullopt;
  return metresOf(root.attribute("unit", "millimeter"));
}

double unitOf3mf(std::string_view bytes) {
  const ZipArchive archive(bytes);
  const auto model = archive.find(modelOf(archive));
  if (!model) throw std::runtime_error("it is a ZIP archive without a 3MF model");
  return metresOf(rootOf(*model).attribute("unit", "millimeter"));
}

}  // namespace adaptive_bvh
