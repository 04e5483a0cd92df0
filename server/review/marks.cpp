#include "server/review/marks.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace parhelion::review {
namespace {

constexpr std::size_t kMaxMarks = 1000;

}  // namespace

std::string notes_path(const std::string& log) {
  return std::filesystem::path(log).replace_extension(".notes.jsonl").string();
}

std::vector<Mark> read_marks(const std::string& notes) {
  std::vector<Mark> marks;
  std::ifstream file(notes);
  for (std::string line; marks.size() < kMaxMarks && std::getline(file, line);) {
    const auto note = nlohmann::json::parse(line, nullptr, false);
    if (!note.is_object()) continue;
    const auto text_of = [&](const char* key) {
      const auto found = note.find(key);
      return found != note.end() && found->is_string() ? found->get<std::string>() : std::string();
    };
    const auto t = note.find("t");
    if (text_of("type") != "mark" || t == note.end() || !t->is_number()) continue;
    const Mark mark{t->get<double>(), text_of("by"), text_of("text")};
    if (std::isfinite(mark.t)) marks.push_back(mark);
  }
  std::stable_sort(marks.begin(), marks.end(), [](const Mark& a, const Mark& b) { return a.t < b.t; });
  return marks;
}

}  // namespace parhelion::review
