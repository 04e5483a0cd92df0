#include "server/review/page.hpp"

#include <array>
#include <charconv>

#include "protocols/sha256.hpp"
#include "protocols/yaml/base64.hpp"
#include "server/review/page_texts.hpp"

namespace parhelion::review {
namespace {

/// In this order: each script may use the definitions of those before it.
constexpr std::array<std::string_view, 6> kScripts{"text.js",     "draw.js",   "map.js",
                                                   "timeline.js", "tables.js", "report.js"};

/// The digest in the format of a content security policy.
std::string policy_hash(const std::string& text) {
  Sha256 hash;
  hash.add({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  const std::string hex = hash.hex();
  std::vector<std::uint8_t> digest(hex.size() / 2);
  for (std::size_t i = 0; i < digest.size(); ++i)
    std::from_chars(&hex[2 * i], &hex[2 * i] + 2, digest[i], 16);
  return "'sha256-" + yaml::to_base64(digest) + "'";
}

/// Escapes every `<`, so that no text can close the element that contains the JSON.
std::string inert(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

void put(std::string& page, std::string_view place, std::string_view text) {
  page.replace(page.find(place), place.size(), text);
}

}  // namespace

std::string to_html(const ReviewPage& page) {
  std::string script = "\"use strict\";\n";
  for (const std::string_view name : kScripts) script += page_text(name);
  const std::string style(page_text("report.css"));
  std::string html(page_text("report.html"));
  put(html, "{{policy}}",
      "default-src 'none'; img-src data:; style-src " + policy_hash(style) + "; script-src " +
          policy_hash(script));
  put(html, "{{style}}", style);
  put(html, "{{script}}", script);
  put(html, "{{review}}", inert(to_json(page)));
  return html;
}

}  // namespace parhelion::review
