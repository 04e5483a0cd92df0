#include "server/station/foxglove/schemas.hpp"

#include <map>
#include <nlohmann/json.hpp>

#include "server/station/foxglove/schema_texts.hpp"

namespace parhelion::station::foxglove {
namespace {

std::map<std::string, std::string, std::less<>> read_schemas() {
  std::map<std::string, std::string, std::less<>> schemas;
  for (const char* file : {kFoxgloveSchemas, kParhelionSchemas}) {
    const auto parsed = nlohmann::ordered_json::parse(file);
    for (const auto& [name, schema] : parsed.items()) schemas.emplace(name, schema.dump());
  }
  return schemas;
}

}  // namespace

std::string schema_text(std::string_view name) {
  static const auto schemas = read_schemas();
  const auto found = schemas.find(name);
  return found == schemas.end() ? std::string() : found->second;
}

}  // namespace parhelion::station::foxglove
