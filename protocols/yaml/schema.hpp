// Checks a document against one of the JSON schemas of this folder and converts its scalars to numbers.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "protocols/yaml/document.hpp"

namespace parhelion::yaml {

/// Checks `root` against `schema` ("scenario", "condition", "model", "robot", "laser", "robot_model",
/// "joystick", "course", "keys"); errors go to `problems`, by line. Sets Node::number. Without problems, each
/// value has the type required by the schema, is finite and in range.
void check(Node& root, std::string_view schema, Problems& problems);

/// Reads one document that is meant for `schema`. Error: what read_document found, by line. Where no key at
/// its top level is one of the schema's, or nearly, or another schema's keys fit better, it is another file:
/// the error names its kind where it is known, and shows nothing else of it.
Result<Node> read_document_for(const std::string& text, const std::string& origin, std::string_view schema);

/// The same, checked against `schema`. Error: what read_document_for or check found, by line.
Result<Node> read_checked(const std::string& text, const std::string& origin, std::string_view schema);

/// The schema whose keys match the document's top level best, misspelt ones included; empty where none does.
std::string guess_schema(const Node& root);

}  // namespace parhelion::yaml
