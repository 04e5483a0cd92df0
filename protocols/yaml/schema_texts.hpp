// The schema files of this folder, compiled in, so that no installed file is needed.
#pragma once

#include <span>
#include <string_view>

namespace parhelion::yaml {

struct SchemaText {
  std::string_view file;  ///< "scenario.schema.json"
  std::string_view text;
};

std::span<const SchemaText> schema_texts();

}  // namespace parhelion::yaml
