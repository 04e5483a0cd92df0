#include "protocols/yaml/choice.hpp"

#include "protocols/enumerators.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {

const Node* only_one(const Node& node, const std::vector<std::string>& keys, const std::string& what,
                     Problems& problems, const std::string& advice) {
  const Node* found = nullptr;
  for (const std::string& key : keys) {
    const Node* here = node.find(key);
    if (here == nullptr) continue;
    if (found != nullptr) problems.add(here->line, what + ": found two, expected one" + advice);
    found = here;
  }
  if (found != nullptr) return found;
  std::string text;
  for (const std::string& key : keys) text += (text.empty() ? "" : ", ") + key;
  problems.add(node.line, what + ": expected one of " + text);
  return nullptr;
}

std::optional<EventKind> read_event_kind(const Node& name, Problems& problems) {
  const auto kind = enumerator(name.text, kLastEventKind);
  if (!kind)
    problems.add(name.line, "unknown event '" + printable(name.text) + "'" +
                                suggestion(name.text, names_up_to(kLastEventKind)));
  return kind;
}

}  // namespace parhelion::yaml
