#include "server/training/event_phrase.hpp"

#include <algorithm>

namespace parhelion::training {
namespace {

struct Phrase {
  EventKind kind;
  const char* doing;
  const char* any;  ///< in place of the object; empty: the event has none
};

constexpr Phrase kPhrases[] = {
    {EventKind::contact_started, "touching", "anything"},
    {EventKind::contact_continues, "staying in contact with", "anything"},
    {EventKind::person_touched, "driving into", "somebody"},
    {EventKind::fell, "falling", ""},
    {EventKind::tipped_over, "tipping over", ""},
    {EventKind::pitch_warning, "pitching too far", ""},
    {EventKind::pitch_limit, "pitching to the limit", ""},
    {EventKind::roll_warning, "rolling too far", ""},
    {EventKind::roll_limit, "rolling to the limit", ""},
    {EventKind::yaw_rate_warning, "turning fast", ""},
    {EventKind::yaw_rate_limit, "turning too fast", ""},
    {EventKind::gripped, "gripping", "anything"},
    {EventKind::lifted, "lifting", "anything"},
    {EventKind::placed, "putting something into", "a container"},
    {EventKind::dropped, "dropping", "anything"},
    {EventKind::zone_entered, "entering", "any zone"},
    {EventKind::zone_left, "leaving", "any zone"},
    {EventKind::hazard_triggered, "setting off", "anything"},
    {EventKind::joint_overload, "overloading", "any joint"},
    {EventKind::joint_broken, "breaking", "any joint"},
    {EventKind::radio_lost, "losing the radio link", ""},
    {EventKind::battery_low, "running low on battery", ""},
    {EventKind::object_reported, "reporting", "anything"},
};

}  // namespace

std::string event_phrase(EventKind kind, const std::string& object) {
  const auto* phrase = std::find_if(std::begin(kPhrases), std::end(kPhrases),
                                    [kind](const Phrase& each) { return each.kind == kind; });
  if (phrase == std::end(kPhrases)) {
    std::string name = to_string(kind);
    std::replace(name.begin(), name.end(), '_', ' ');
    return object.empty() ? name : name + " with " + object;
  }
  const std::string doing = phrase->doing, any = phrase->any;
  if (any.empty()) return object.empty() ? doing : doing + " with " + object;
  return doing + " " + (object.empty() ? any : object);
}

}  // namespace parhelion::training
