#include "protocols/yaml/schema.hpp"

#include <charconv>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <stdexcept>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "protocols/nearest_name.hpp"
#include "protocols/yaml/quantity.hpp"
#include "protocols/yaml/schema_texts.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {
namespace {

using Json = nlohmann::json;

const std::map<std::string, Json, std::less<>>& schema_files() {
  static const auto files = [] {
    std::map<std::string, Json, std::less<>> parsed;
    for (const SchemaText& entry : schema_texts()) parsed.emplace(entry.file, Json::parse(entry.text));
    return parsed;
  }();
  return files;
}

/// Replaces "$ref": "file#/pointer" by its target. The schemas contain no cycle.
Json expand(const Json& schema) {
  if (schema.is_array()) {
    Json out = Json::array();
    for (const Json& item : schema) out.push_back(expand(item));
    return out;
  }
  if (!schema.is_object()) return schema;
  if (schema.contains("$ref")) {
    const auto& reference = schema["$ref"].get_ref<const std::string&>();
    const std::size_t hash = std::min(reference.find('#'), reference.size());
    const Json& file = schema_files().at(reference.substr(0, hash));
    if (hash == reference.size()) return expand(file);
    return expand(file.at(Json::json_pointer(reference.substr(hash + 1))));
  }
  Json out = Json::object();
  for (const auto& [key, value] : schema.items()) out[key] = expand(value);
  return out;
}

/// Nodes that their readers check separately: conditions nest to any depth.
constexpr const char* kAny = "any";

/// The document after conversion: a text with a unit has become a number.
Json converted(const Json& schema) {
  if (schema.is_array() || !schema.is_structured()) return schema;
  Json out = Json::object();
  if (schema.contains("type") && schema["type"] == kAny) return out;
  for (const auto& [key, value] : schema.items()) out[key] = converted(value);
  if (schema.contains("unit") && schema["unit"].is_string()) {
    if (schema.contains("words")) {
      out["type"] = Json::array({"number", "string"});
    } else {
      out["type"] = "number";
    }
  }
  return out;
}

struct Schema {
  Json text;                  ///< expanded, units as in the file
  valijson::Schema compiled;  ///< for converted documents
};

const Schema& schema_named(std::string_view name) {
  static const auto schemas = [] {
    std::map<std::string, Schema, std::less<>> all;
    for (const char* known :
         {"scenario", "condition", "model", "robot", "laser", "robot_model", "joystick", "course", "keys"}) {
      Schema& schema = all[known];
      schema.text = expand(schema_files().at(std::string(known) + ".schema.json"));
      const Json number_schema = converted(schema.text);
      valijson::SchemaParser parser(valijson::SchemaParser::kDraft7);
      parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(number_schema), schema.compiled);
    }
    return all;
  }();
  return schemas.find(name)->second;
}

std::vector<std::string> names_of(const Json& list) { return list.get<std::vector<std::string>>(); }

std::vector<std::string> keys_of(const Json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return keys;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " or " : ", ";
    text += names[i];
  }
  return text;
}

const char* kind_text(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return "nothing";
    case Node::Kind::scalar:
      return "a single value";
    case Node::Kind::list:
      return "a list";
    case Node::Kind::map:
      return "keys with values";
  }
  return "";
}

/// Walks document and schema in parallel: converts values, and reports mismatches in readable messages.
class Checker {
 public:
  explicit Checker(Problems& problems) : problems_(problems) {}

  /// `name`: of the key that the node belongs to.
  Json convert(Node& node, const Json& schema, const std::string& name) {
    const auto& type = schema.at("type").get_ref<const std::string&>();
    if (type == "object") return convert_map(node, schema, name);
    if (type == "array") return convert_list(node, schema, name);
    if (type == kAny) return nullptr;
    if (node.kind != Node::Kind::scalar) {
      problems_.add(node.line, "'" + name + "': expected " + wanted(schema) + ", found " + kind_text(node));
      return nullptr;
    }
    if (node.binary != schema.contains("binary")) {
      problems_.add(node.line, "'" + name + "': expected " + wanted(schema) +
                                   (node.binary ? ", found !!binary" : ", found a single value"));
      return nullptr;
    }
    if (node.binary) return "";  // checked by read_binary(): avoids copying megabytes
    if (type == "string" && !schema.contains("unit")) return convert_text(node, schema, name);
    if (type == "boolean") return convert_boolean(node, name);
    return convert_number(node, schema, name);
  }

 private:
  static std::string wanted(const Json& schema) {
    if (schema.contains("binary")) return "!!binary and base64";
    if (schema.contains("unit")) return "a number with its unit";
    if (schema.contains("enum")) return listed(names_of(schema["enum"]));
    const auto& type = schema.at("type").get_ref<const std::string&>();
    return type == "string" ? "text" : type == "boolean" ? "true or false" : "a number";
  }

  Json convert_map(Node& node, const Json& schema, const std::string& name) {
    if (node.kind != Node::Kind::map) {
      problems_.add(node.line, (name.empty() ? "" : "'" + name + "': ") +
                                   "expected keys with values, found " + kind_text(node));
      return nullptr;
    }
    static const Json none = Json::object();
    const Json& properties = schema.contains("properties") ? schema["properties"] : none;
    const Json& others = schema.at("additionalProperties");
    Json out = Json::object();
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      const std::string& key = node.keys[i];
      if (const auto known = properties.find(key); known != properties.end()) {
        out[key] = convert(node.items[i], *known, key);
      } else if (others.is_object()) {
        out[key] = convert(node.items[i], others, printable(key));
      } else {
        problems_.add(node.key_lines[i],
                      "unknown key '" + printable(key) + "'" + unknown_hint(key, keys_of(properties)));
      }
    }
    for (const std::string& key :
         schema.contains("required") ? names_of(schema["required"]) : std::vector<std::string>()) {
      if (node.find(key) == nullptr) {
        problems_.add(node.line, "key '" + key + "' is missing" + (name.empty() ? "" : " in '" + name + "'"));
      }
    }
    return out;
  }

  static std::string unknown_hint(const std::string& key, const std::vector<std::string>& known) {
    const std::string nearest = suggestion(key, known);
    return nearest.empty() ? ", expected one of " + listed(known) : nearest;
  }

  Json convert_list(Node& node, const Json& schema, const std::string& name) {
    if (node.kind != Node::Kind::list) {
      problems_.add(node.line, "'" + name + "': expected a list, found " + kind_text(node));
      return nullptr;
    }
    const auto count = node.items.size();
    if (schema.contains("minItems") && count < schema["minItems"].get<std::size_t>()) {
      add_count(node, name, "at least", schema["minItems"]);
    }
    if (schema.contains("maxItems") && count > schema["maxItems"].get<std::size_t>()) {
      add_count(node, name, "at most", schema["maxItems"]);
    }
    Json out = Json::array();
    for (Node& item : node.items) out.push_back(convert(item, schema.at("items"), name));
    return out;
  }

  void add_count(const Node& node, const std::string& name, const char* relation, const Json& bound) {
    problems_.add(node.line, "'" + name + "': expected " + relation + ' ' + bound.dump() +
                                 (bound == 1 ? " item, found " : " items, found ") +
                                 std::to_string(node.items.size()));
  }

  Json convert_text(Node& node, const Json& schema, const std::string& name) {
    if (schema.contains("enum")) {
      const auto allowed = names_of(schema["enum"]);
      if (std::find(allowed.begin(), allowed.end(), node.text) == allowed.end()) {
        problems_.add(node.line, "'" + name + "': expected " + listed(allowed) + ", found '" +
                                     printable(node.text) + "'" + suggestion(node.text, allowed));
      }
    }
    if (schema.contains("minLength") && node.text.empty())
      problems_.add(node.line, "'" + name + "' is empty");
    if (schema.contains("pattern") &&
        !std::regex_search(node.text, std::regex(schema["pattern"].get<std::string>())))
      problems_.add(node.line, "'" + name + "': expected " + schema.at("expected").get<std::string>() +
                                   ", found '" + printable(node.text) + "'");
    return node.text;
  }

  Json convert_boolean(Node& node, const std::string& name) {
    if (node.text != "true" && node.text != "false") {
      problems_.add(node.line,
                    "'" + name + "': expected true or false, found '" + printable(node.text) + "'");
    }
    node.number = node.text == "true" ? 1 : 0;
    return node.text == "true";
  }

  Json convert_number(Node& node, const Json& schema, const std::string& name) {
    if (schema.contains("words")) {
      const auto words = names_of(schema["words"]);
      if (std::find(words.begin(), words.end(), node.text) != words.end()) return node.text;
    }
    const bool integer = schema.at("type") == "integer";
    if (integer) return convert_integer(node, schema, name);
    const auto value = schema.contains("unit")
                           ? parse_quantity(node.text, *quantity_named(schema["unit"].get<std::string>()))
                           : parse_number(node.text);
    if (!value) {
      const std::string words =
          schema.contains("words") ? " (or " + listed(names_of(schema["words"])) + ")" : "";
      problems_.add(node.line, "'" + name + "': " + value.error().message + words);
      return nullptr;
    }
    node.number = *value;
    node.is_number = true;
    check_bounds(node, schema, name);
    return *value;
  }

  Json convert_integer(Node& node, const Json& schema, const std::string& name) {
    const char* end = node.text.data() + node.text.size();
    std::int64_t signed_value = 0;
    std::uint64_t unsigned_value = 0;
    const auto as_signed = std::from_chars(node.text.data(), end, signed_value);
    const auto as_unsigned = std::from_chars(node.text.data(), end, unsigned_value);
    const bool is_signed = as_signed.ec == std::errc{} && as_signed.ptr == end;
    if (!is_signed && (as_unsigned.ec != std::errc{} || as_unsigned.ptr != end)) {
      problems_.add(node.line,
                    "'" + name + "': expected a whole number, found '" + printable(node.text) + "'");
      return nullptr;
    }
    node.number = is_signed ? static_cast<double>(signed_value) : static_cast<double>(unsigned_value);
    node.is_number = true;
    check_bounds(node, schema, name);
    // valijson reads integers as int64: a larger one is treated as the largest.
    return is_signed ? signed_value : std::numeric_limits<std::int64_t>::max();
  }

  void check_bounds(const Node& node, const Json& schema, const std::string& name) {
    const auto bound = [&](const char* keyword, const char* relation, auto holds) {
      if (!schema.contains(keyword) || holds(node.number, schema[keyword].get<double>())) return;
      const double limit = schema[keyword].get<double>();
      const std::string unit =
          schema.contains("unit")
              ? ' ' + std::string(base_unit(*quantity_named(schema["unit"].get<std::string>())))
              : "";
      problems_.add(node.line, "'" + name + "': expected " + name + ' ' + relation + ' ' +
                                   format_number(limit) + unit + ", found '" + printable(node.text) + "'");
    };
    bound("minimum", ">=", [](double a, double b) { return a >= b; });
    bound("maximum", "<=", [](double a, double b) { return a <= b; });
    bound("exclusiveMinimum", ">", [](double a, double b) { return a > b; });
    bound("exclusiveMaximum", "<", [](double a, double b) { return a < b; });
  }

  Problems& problems_;
};

/// Line of the node at valijson's path ("<root>", "[agents]", "[0]", ...), or of the last known node.
int line_of(const Node& root, const std::vector<std::string>& path) {
  const Node* node = &root;
  for (std::size_t i = 1; i < path.size() && path[i].size() > 2; ++i) {
    const std::string step = path[i].substr(1, path[i].size() - 2);
    const Node* next = node->find(step);
    std::size_t index = 0;
    const auto [end, code] = std::from_chars(step.data(), step.data() + step.size(), index);
    if (node->kind == Node::Kind::list && code == std::errc{} && index < node->items.size())
      next = &node->items[index];
    if (next == nullptr) break;
    node = next;
  }
  return node->line;
}

/// The keys at the top level of a text that need not be YAML: what stands before a colon at the beginning of
/// a line, or anywhere in a document in flow style. At most 1,000, of the first megabyte.
std::vector<std::string> top_keys(std::string_view text) {
  static const std::regex in_block(R"re((?:^|\n)["']?([A-Za-z0-9_]{1,64})["']?\s*:(?=\s|$))re");
  static const std::regex in_flow(R"re([{,]\s*["']?([A-Za-z0-9_]{1,64})["']?\s*:)re");
  text = text.substr(0, std::size_t{1} << 20);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  const bool flow = first != std::string_view::npos && text[first] == '{';
  std::vector<std::string> keys;
  for (std::cregex_iterator at(text.data(), text.data() + text.size(), flow ? in_flow : in_block), end;
       at != end && keys.size() < 1000; ++at)
    keys.push_back((*at)[1]);
  return keys;
}

/// Whether files of several kinds have the key.
bool is_common(const std::string& key) {
  return key == "name" || key == "source" || key == "pose" || key == "version";
}

/// Whether the text is meant for a schema with these keys: one of its own is among them, or nearly.
bool is_meant_for(const std::string& text, const std::vector<std::string>& names) {
  const bool is_empty = text.find_first_not_of(" \t\r\n{}") == std::string::npos;
  const std::vector<std::string> keys = top_keys(text);
  const auto is_ours = [&](const std::string& key) {
    return !is_common(key) &&
           (std::find(names.begin(), names.end(), key) != names.end() || !nearest_name(key, names).empty());
  };
  return is_empty || std::any_of(keys.begin(), keys.end(), is_ours) ||
         (!keys.empty() && std::all_of(keys.begin(), keys.end(), is_common));
}

}  // namespace

void check(Node& root, std::string_view name, Problems& problems) {
  const Schema& schema = schema_named(name);
  Checker checker(problems);
  const Json document = checker.convert(root, schema.text, "");
  if (!problems.empty()) return;
  // Final check: catches schema keywords that the walk above does not handle.
  valijson::Validator validator;
  valijson::ValidationResults results;
  if (validator.validate(schema.compiled, valijson::adapters::NlohmannJsonAdapter(document), &results))
    return;
  for (const auto& fault : results) problems.add(line_of(root, fault.context), fault.description);
}

Result<Node> read_document_for(const std::string& text, const std::string& origin, std::string_view schema) {
  const Json& known = schema_named(schema).text;
  const auto names = keys_of(known.at("properties"));
  if (const Status is_text = check_text(text, origin); !is_text) return is_text.error();
  if (!is_meant_for(text, names)) {
    return Error{origin + ": is not a file of the kind '" + known.at("title").get<std::string>() +
                 "': expected keys such as " +
                 listed({names.begin(), names.begin() + std::min<std::ptrdiff_t>(3, std::ssize(names))})};
  }
  auto document = read_document(text, origin);
  if (!document) return document;
  const bool has_ours =
      std::any_of(document->keys.begin(), document->keys.end(), [&](const std::string& key) {
        return !is_common(key) && std::find(names.begin(), names.end(), key) != names.end();
      });
  if (const std::string kind = guess_schema(*document); !has_ours && !kind.empty() && kind != schema)
    return Error{origin + ": is a file of the kind '" +
                 schema_named(kind).text.at("title").get<std::string>() + "', expected one of the kind '" +
                 known.at("title").get<std::string>() + "'"};
  return document;
}

Result<Node> read_checked(const std::string& text, const std::string& origin, std::string_view schema) {
  auto document = read_document_for(text, origin, schema);
  if (!document) return document.error();
  Problems problems(origin);
  check(*document, schema, problems);
  if (!problems.empty()) return problems.error();
  return document;
}

std::string guess_schema(const Node& root) {
  std::string best;
  std::size_t best_score = 0;
  for (const char* name : {"scenario", "model", "robot", "laser", "robot_model", "joystick", "course"}) {
    const Json& properties = schema_named(name).text.at("properties");
    const auto names = keys_of(properties);
    std::size_t known = 0;
    for (const std::string& key : root.keys) {
      if (is_common(key)) continue;
      known += properties.contains(key) ? 2 : nearest_name(key, names).empty() ? 0 : 1;
    }
    if (known > best_score) {
      best_score = known;
      best = name;
    }
  }
  return best;
}

}  // namespace parhelion::yaml
