#include "server/training/exchange.hpp"

#include <string_view>

namespace parhelion::training {
namespace {

Result<std::string> pseudonym_of(Records& records, TraineeRecord trainee, Taken& taken) {
  if (!trainee.pseudonym.empty() && !is_pseudonym(trainee.pseudonym)) {
    if (trainee.name.empty()) trainee.name = trainee.pseudonym;
    trainee.pseudonym.clear();
  }
  for (const std::string* key : {&trainee.pseudonym, &trainee.mbox_sha1sum, &trainee.name}) {
    if (key->empty()) continue;
    if (const auto known = records.find(*key)) return known->pseudonym;
  }
  const auto added = records.add(trainee);
  if (!added) return added.error();
  ++taken.trainees;
  return added->pseudonym;
}

}  // namespace

Result<Histories> histories_from(const std::string& text, const std::string& origin) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) return histories_from(text.substr(kByteOrderMark.size()), origin);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos)
    return Error{origin + ": is empty; expected records in JSON or CSV, or xAPI statements"};
  if (text[first] == '[') return histories_from_xapi(text, origin);
  if (text[first] != '{') return histories_from_csv(text, origin);
  return text.find("\"parhelion records\"") < 200 ? histories_from_json(text, origin)
                                                  : histories_from_xapi(text, origin);
}

Result<Taken> take(Records& records, const Histories& histories) {
  Taken taken;
  const Status done = records.together([&]() -> Status {
    for (const TraineeHistory& history : histories.trainees) {
      const auto pseudonym = pseudonym_of(records, history.trainee, taken);
      if (!pseudonym) return pseudonym.error();
      for (const SessionRecord& session : history.sessions) {
        const auto stored = records.store(*pseudonym, session);
        if (!stored) return stored.error();
        ++(*stored == Records::Stored::added ? taken.sessions : taken.present);
      }
    }
    return {};
  });
  if (!done) return done.error();
  return taken;
}

}  // namespace parhelion::training
