#include "server/simulation/robots/xml_fault.hpp"

#include <algorithm>
#include <vector>

#include "protocols/yaml/utf8.hpp"

namespace parhelion::simulation {
namespace {

constexpr std::string_view kSpaces = " \t\r\n";

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  std::optional<XmlFault> run() {
    if (text_.find_first_not_of(kSpaces) == std::string_view::npos) return XmlFault{1, "the file is empty"};
    for (std::size_t i = 0; i < text_.size(); ++i) {
      const auto byte = static_cast<unsigned char>(text_[i]);
      if (byte < 32 && kSpaces.find(text_[i]) == std::string_view::npos)
        return fault(
            i, "a byte of value " + std::to_string(byte) + ", which no text has: this is a binary file");
    }
    if (text_.find('<') == std::string_view::npos) return XmlFault{1, "no tag in it: this is no XML"};
    for (std::size_t at = text_.find('<'); at != std::string_view::npos; at = text_.find('<', at)) {
      if (auto found = read_tag(at)) return found;
    }
    if (open_.empty()) return std::nullopt;
    return fault(text_.size(), "the file ends, but " + named(open_.back()) + " is not closed");
  }

 private:
  struct Open {
    std::string_view name;
    std::size_t at;
  };

  int line_of(std::size_t at) const {
    const std::string_view before = text_.substr(0, std::min(at, text_.size()));
    const auto lines = std::count(before.begin(), before.end(), '\n');
    // The end of the last line is of that line.
    return static_cast<int>(at >= text_.size() && text_.ends_with('\n') ? lines : lines + 1);
  }
  XmlFault fault(std::size_t at, std::string words) const { return {line_of(at), std::move(words)}; }
  static std::string tag(std::string_view name) { return "<" + yaml::printable(std::string(name)) + ">"; }
  std::string named(const Open& open) const {
    return tag(open.name) + " of line " + std::to_string(line_of(open.at));
  }

  /// Of the tag, comment or instruction at `at`, which is moved behind it.
  std::optional<XmlFault> read_tag(std::size_t& at) {
    constexpr std::string_view kinds[][2] = {
        {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}, {"<!", ">"}};
    for (const auto& [opening, closing] : kinds) {
      if (!text_.substr(at).starts_with(opening)) continue;
      const std::size_t end = text_.find(closing, at + opening.size());
      if (end == std::string_view::npos)
        return fault(at, "what begins with " + std::string(opening) + " is not closed; expected " +
                             std::string(closing));
      at = end + closing.size();
      return std::nullopt;
    }
    return read_element(at);
  }

  std::optional<XmlFault> read_element(std::size_t& at) {
    const std::size_t begin = at;
    const bool closes = text_.substr(at).starts_with("</");
    const std::size_t name_at = at + (closes ? 2 : 1);
    const std::size_t name_end = std::min(text_.find_first_of(" \t\r\n/><", name_at), text_.size());
    const std::string_view name = text_.substr(name_at, name_end - name_at);
    if (name.empty()) return fault(begin, "a < without the name of a tag; in a text write &lt;");
    std::size_t end = name_end;
    for (; end < text_.size() && text_[end] != '>'; ++end) {
      if (text_[end] == '<')
        return fault(begin, "the tag " + tag(name) + " is not closed; expected > before the next <");
      if (text_[end] != '"' && text_[end] != '\'') continue;
      const std::size_t quote = text_.find(text_[end], end + 1);
      const std::size_t next_tag = text_.find('<', end + 1);
      if (quote == std::string_view::npos || next_tag < quote)
        return fault(end, "a quote in the tag " + tag(name) + " is not closed");
      end = quote;
    }
    if (end >= text_.size()) return fault(begin, "the tag " + tag(name) + " is not closed; expected >");
    at = end + 1;
    if (closes) return close(name, begin);
    if (text_[end - 1] != '/') open_.push_back({name, begin});
    return std::nullopt;
  }

  std::optional<XmlFault> close(std::string_view name, std::size_t at) {
    if (open_.empty()) return fault(at, tag("/" + std::string(name)) + " closes nothing");
    if (open_.back().name != name)
      return fault(at,
                   tag("/" + std::string(name)) + ", but " + named(open_.back()) + " is to be closed first");
    open_.pop_back();
    return std::nullopt;
  }

  std::string_view text_;
  std::vector<Open> open_;
};

}  // namespace

std::optional<XmlFault> find_xml_fault(std::string_view text) { return Scanner(text).run(); }

}  // namespace parhelion::simulation
