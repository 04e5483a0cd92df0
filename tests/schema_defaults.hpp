// Holds the "default" of each schema key, which the references are generated from, against what the program
// reads where the key is missing.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocols/yaml/schema_texts.hpp"

namespace parhelion::test {

class SchemaDefaults {
 public:
  using Json = nlohmann::json;
  /// All values that were read from a document; nullopt: it was refused.
  using Read = std::function<std::optional<std::string>(const std::string& yaml)>;

  SchemaDefaults(const std::string& schema, Read read) : read_(std::move(read)) {
    for (const yaml::SchemaText& entry : yaml::schema_texts())
      files_[std::string(entry.file)] = Json::parse(entry.text);
    root_ = files_.at(schema + ".schema.json");
    collect(root_, "");
  }

  /// Compares reading `document` without a key and with its default, for each key that has one.
  void compare(const Json& document) {
    document_ = document;
    if (!read_(document.dump())) differences_.push_back("refused: " + document.dump());
    visit(root_, "", Json::json_pointer());
  }

  /// Keys whose default is not what the program reads.
  const std::vector<std::string>& differences() const { return differences_; }
  /// Keys with a default that no document has shown.
  std::set<std::string> missing() const {
    std::set<std::string> left = stated_;
    for (const std::string& path : compared_) left.erase(path);
    return left;
  }

 private:
  /// What "$ref" names, with the keywords beside it in place of its own.
  Json resolved(const Json& schema) const {
    if (!schema.contains("$ref")) return schema;
    const auto reference = schema["$ref"].get<std::string>();
    const std::size_t hash = std::min(reference.find('#'), reference.size());
    const Json& file = files_.at(reference.substr(0, hash));
    const bool whole = hash == reference.size();
    Json out = resolved(whole ? file : file.at(Json::json_pointer(reference.substr(hash + 1))));
    for (const auto& [key, value] : schema.items())
      if (key != "$ref") out[key] = value;
    return out;
  }

  static bool any_names(const Json& schema) {
    return schema.contains("additionalProperties") && schema["additionalProperties"].is_object();
  }

  void collect(const Json& reference, const std::string& path) {
    const Json schema = resolved(reference);
    if (schema.contains("default")) stated_.insert(path);
    if (schema.contains("items")) collect(schema["items"], path + "[]");
    const Json keys = schema.value("properties", Json::object());
    for (const auto& [key, value] : keys.items()) collect(value, path + "." + key);
    if (any_names(schema)) collect(schema["additionalProperties"], path + ".*");
  }

  void visit(const Json& reference, const std::string& path, const Json::json_pointer& place) {
    const Json schema = resolved(reference);
    if (schema.contains("default")) compare_key(schema["default"], path, place);
    if (!document_.contains(place)) return;
    if (schema.contains("items")) {
      for (std::size_t i = 0; i < document_[place].size(); ++i)
        visit(schema["items"], path + "[]", place / i);
    }
    const Json keys = schema.value("properties", Json::object());
    for (const auto& [key, value] : keys.items()) visit(value, path + "." + key, place / key);
    if (any_names(schema)) {
      for (const auto& [key, value] : document_[place].items())
        visit(schema["additionalProperties"], path + ".*", place / key);
    }
  }

  void compare_key(const Json& value, const std::string& path, const Json::json_pointer& place) {
    Json without = document_, with = document_;
    if (without.contains(place)) without[place.parent_pointer()].erase(place.back());
    with[place] = value;
    const auto missing = read_(without.dump()), given = read_(with.dump());
    if (!missing || !given) return;  // a key that does not go with the others; missing() tells if all refuse
    compared_.insert(path);
    if (*missing != *given) differences_.push_back(path + ": the default is not " + value.dump());
  }

  Read read_;
  std::map<std::string, Json> files_;
  Json root_, document_;
  std::set<std::string> stated_, compared_;
  std::vector<std::string> differences_;
};

}  // namespace parhelion::test
