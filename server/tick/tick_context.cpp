#include "server/tick/tick_context.hpp"

#include <algorithm>
#include <utility>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/tick/grading_path.hpp"
#include "server/tick/scripts.hpp"

namespace parhelion::tick {

void publish_event(const TickContext& context, const Event& event) {
  ++context.tally.events[static_cast<std::size_t>(event.kind) % context.tally.events.size()];
  context.listeners.scripts.handle(event);
  std::vector<std::uint8_t>& payload =
      context.outputs.add(context.configuration.channels.bus(channel::kMrEvents));
  encode(event, payload);
  if (context.listeners.grading != nullptr) grade_event(context, payload, *context.listeners.grading);
}

std::string without_numbers(std::string_view text) {
  std::string rest;
  for (const char each : text)
    if ((each < '0' || each > '9') && each != '-' && each != '.') rest += each;
  return rest;
}

void refuse(const TickContext& context, const Error& error) {
  constexpr std::size_t max_kinds = 32;
  Tally& tally = context.tally;
  ++tally.refused_inputs;
  tally.last_refusal = error.message;
  std::string kind = without_numbers(error.message);
  auto known = std::find_if(tally.refusals.begin(), tally.refusals.end(),
                            [&](const Refusal& each) { return each.kind == kind; });
  if (known == tally.refusals.end()) {
    if (tally.refusals.size() == max_kinds) tally.refusals.erase(tally.refusals.begin());
    known = tally.refusals.insert(tally.refusals.end(), Refusal{std::move(kind), {}, 0});
  }
  known->text = error.message;
  ++known->count;
  std::rotate(known, known + 1, tally.refusals.end());
}

}  // namespace parhelion::tick
