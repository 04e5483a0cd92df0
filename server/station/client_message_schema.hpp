// The schema of messages from pages, compiled in so that the server needs no installed file.
#pragma once

namespace parhelion::station {

/// client_messages.schema.json.
extern const char* const kClientMessageSchemaText;

}  // namespace parhelion::station
