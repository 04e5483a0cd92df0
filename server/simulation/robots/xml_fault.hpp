// What is wrong with a text that is no XML, for the person who writes it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace parhelion::simulation {

struct XmlFault {
  int line = 1;       ///< where the fault is, from 1
  std::string words;  ///< what is wrong there, and what was expected
};

/// The first fault in the nesting of tags, in a tag's quotes, or of the bytes; nullopt: none of these.
std::optional<XmlFault> find_xml_fault(std::string_view text);

}  // namespace parhelion::simulation
