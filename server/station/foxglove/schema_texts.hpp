// The files of schemas, compiled in: JSON objects whose members are schemas by their names.
#pragma once

namespace parhelion::station::foxglove {

extern const char* const kFoxgloveSchemas;   ///< foxglove_schemas.json, written by tools/page
extern const char* const kParhelionSchemas;  ///< parhelion_schemas.json

}  // namespace parhelion::station::foxglove
