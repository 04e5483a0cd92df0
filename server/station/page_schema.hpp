// The schema of messages from pages, compiled in so that the server needs no installed file.
#pragma once

namespace parhelion::station {

/// page_messages.schema.json.
extern const char* const page_schema_text;

}  // namespace parhelion::station
