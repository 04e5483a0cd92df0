// CSV: one line per session.
#include <algorithm>
#include <charconv>
#include <functional>
#include <map>

#include "protocols/nearest_name.hpp"
#include "server/training/csv.hpp"
#include "server/training/exchange.hpp"

namespace parhelion::training {
namespace {

using Fields = std::vector<std::string>;

template <class Number>
bool number_of(const std::string& text, Number& number) {
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  return read.ec == std::errc() && read.ptr == text.data() + text.size();
}

bool flag_of(const std::string& text, bool& flag) {
  flag = text == "1";
  return flag || text == "0";
}

/// One line's content.
struct Line {
  TraineeRecord trainee;
  SessionRecord session;
};

struct Column {
  const char* name;
  const char* expected;
  std::function<std::string(const Line&)> text;
  std::function<bool(const std::string&, Line&)> read;
};

template <class Part>
Column text_column(const char* name, Part part) {
  return {name, "a text", [part](const Line& line) { return part(line); },
          [part](const std::string& text, Line& line) { return part(line) = text, true; }};
}
template <class Part>
Column number_column(const char* name, const char* expected, Part part) {
  return {name, expected, [part](const Line& line) { return csv_number(part(line)); },
          [part](const std::string& text, Line& line) { return number_of(text, part(line)); }};
}
template <class Part>
Column flag_column(const char* name, Part part) {
  return {name, "0 or 1", [part](const Line& line) { return part(line) ? "1" : "0"; },
          [part](const std::string& text, Line& line) { return flag_of(text, part(line)); }};
}

const std::vector<Column>& columns() {
  static const std::vector<Column> all{
      text_column(
          "trainee", [](auto& line) -> auto& { return line.trainee.pseudonym; }),
      text_column(
          "name", [](auto& line) -> auto& { return line.trainee.name; }),
      text_column(
          "mbox_sha1sum", [](auto& line) -> auto& { return line.trainee.mbox_sha1sum; }),
      text_column(
          "identity", [](auto& line) -> auto& { return line.session.identity; }),
      text_column(
          "scenario", [](auto& line) -> auto& { return line.session.scenario; }),
      text_column(
          "programme", [](auto& line) -> auto& { return line.session.programme; }),
      number_column(
          "level", "1, 2, 3, or 0: not known", [](auto& line) -> auto& { return line.session.level; }),
      text_column(
          "robot", [](auto& line) -> auto& { return line.session.robot; }),
      text_column(
          "log", [](auto& line) -> auto& { return line.session.log; }),
      number_column(
          "skipped_bytes", "bytes", [](auto& line) -> auto& { return line.session.skipped_bytes; }),
      number_column(
          "begin_ns", "ns since the epoch", [](auto& line) -> auto& { return line.session.grade.begin.ns; }),
      number_column(
          "end_ns", "ns since the epoch", [](auto& line) -> auto& { return line.session.grade.end.ns; }),
      number_column(
          "score", "points", [](auto& line) -> auto& { return line.session.grade.score; }),
      number_column(
          "awarded", "points", [](auto& line) -> auto& { return line.session.grade.awarded; }),
      number_column(
          "deducted", "points", [](auto& line) -> auto& { return line.session.grade.deducted; }),
      number_column(
          "max", "points", [](auto& line) -> auto& { return line.session.grade.max; }),
      number_column(
          "fraction", "0 to 1", [](auto& line) -> auto& { return line.session.grade.fraction; }),
      text_column(
          "grade", [](auto& line) -> auto& { return line.session.grade.grade; }),
      flag_column(
          "passed", [](auto& line) -> auto& { return line.session.grade.passed; }),
      flag_column(
          "ended", [](auto& line) -> auto& { return line.session.grade.ended; }),
      flag_column(
          "complete", [](auto& line) -> auto& { return line.session.grade.complete; })};
  return all;
}
constexpr std::size_t kTraineeColumns = 3;

/// Splits RFC 4180 text; CRLF and LF both end a line, and within quotes neither does.
class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}
  /// Line number at which the newest fields began.
  std::size_t line() const { return begun_; }
  bool at_end() const { return at_ >= text_.size(); }
  /// False: unclosed quotes.
  bool next(Fields& fields) {
    fields.assign(1, "");
    begun_ = line_;
    bool inside = false;
    for (; at_ < text_.size(); ++at_) {
      const char letter = text_[at_];
      if (letter == '\n') ++line_;
      if (inside && letter == '"' && at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
        fields.back() += '"';
        ++at_;
      } else if (letter == '"') {
        inside = !inside;
      } else if (!inside && letter == ',') {
        fields.emplace_back();
      } else if (!inside && letter == '\n') {
        ++at_;
        break;
      } else if (inside || letter != '\r') {
        fields.back() += letter;
      }
    }
    return !inside;
  }

 private:
  const std::string& text_;
  std::size_t at_ = 0, line_ = 1, begun_ = 1;
};

Result<std::vector<const Column*>> header_of(const Fields& names) {
  std::vector<std::string> known;
  for (const Column& column : columns()) known.emplace_back(column.name);
  std::vector<const Column*> order;
  for (const std::string& name : names) {
    const Column* found = nullptr;
    for (const Column& column : columns())
      if (name == column.name) found = &column;
    if (found == nullptr)
      return Error{"there is no column '" + name + "'" + suggestion_or_known(name, known)};
    order.push_back(found);
  }
  for (const Column& column : columns()) {
    const auto times = std::count(order.begin(), order.end(), &column);
    const bool must = &column == &columns()[0] || &column >= &columns()[kTraineeColumns];
    if (times > 1) return Error{"column '" + std::string(column.name) + "' occurs twice"};
    if (times == 0 && must) return Error{"column '" + std::string(column.name) + "' is missing"};
  }
  return order;
}

Status read_line(const Fields& fields, const std::vector<const Column*>& order, Line& line) {
  if (fields.size() != order.size())
    return Error{std::to_string(fields.size()) + " fields; expected " + std::to_string(order.size())};
  bool session = false;  // or a trainee without sessions
  for (std::size_t i = 0; i < fields.size(); ++i)
    session = session || (!fields[i].empty() && order[i] >= &columns()[kTraineeColumns]);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (!session && order[i] >= &columns()[kTraineeColumns]) continue;
    if (!order[i]->read(fields[i], line))
      return Error{std::string(order[i]->name) + " '" + fields[i] + "'; expected " + order[i]->expected};
  }
  const TraineeRecord& trainee = line.trainee;
  if (trainee.pseudonym.empty() && trainee.name.empty() && trainee.mbox_sha1sum.empty())
    return Error{"it names no trainee: neither a pseudonym nor a name nor an mbox_sha1sum"};
  if (session && line.session.identity.empty()) return Error{"a session without an identity"};
  return {};
}

}  // namespace

std::string to_csv(const std::vector<TraineeHistory>& trainees) {
  std::string text;
  for (const Column& column : columns()) text += (text.empty() ? "" : ",") + std::string(column.name);
  text += "\r\n";
  for (const TraineeHistory& history : trainees) {
    const std::size_t lines = std::max<std::size_t>(1, history.sessions.size());
    for (std::size_t i = 0; i < lines; ++i) {
      const bool session = i < history.sessions.size();
      const Line line{history.trainee, session ? history.sessions[i] : SessionRecord()};
      for (std::size_t c = 0; c < columns().size(); ++c) {
        if (c > 0) text += ',';
        if (session || c < kTraineeColumns) text += csv_field(columns()[c].text(line));
      }
      text += "\r\n";
    }
  }
  return text;
}

Result<Histories> histories_from_csv(const std::string& text, const std::string& origin) {
  Reader reader(text);
  const auto at = [&] { return origin + ":" + std::to_string(reader.line()) + ": "; };
  Fields fields;
  if (!reader.next(fields)) return Error{at() + "a quote is not closed"};
  const auto order = header_of(fields);
  if (!order) return Error{at() + order.error().message};
  Histories histories;
  std::map<std::string, std::size_t> places;
  while (!reader.at_end()) {
    if (!reader.next(fields)) return Error{at() + "a quote is not closed"};
    // Some programs write empty rows as commas.
    if (std::all_of(fields.begin(), fields.end(), [](const auto& field) { return field.empty(); })) continue;
    Line line;
    if (const Status read = read_line(fields, *order, line); !read) return Error{at() + read.error().message};
    const std::string who =
        line.trainee.pseudonym + '\n' + line.trainee.mbox_sha1sum + '\n' + line.trainee.name;
    const auto [place, is_new] = places.try_emplace(who, histories.trainees.size());
    if (is_new) histories.trainees.push_back({line.trainee, {}});
    if (!line.session.identity.empty())
      histories.trainees[place->second].sessions.push_back(std::move(line.session));
  }
  return histories;
}

}  // namespace parhelion::training
