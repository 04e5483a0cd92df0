// The schema of what pages may say, compiled in: the server needs no installed file.
#pragma once

namespace parhelion::station {

/// page_messages.schema.json.
extern const char* const page_schema_text;

}  // namespace parhelion::station
