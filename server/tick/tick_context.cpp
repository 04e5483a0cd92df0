#include "server/tick/tick_context.hpp"

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

void refuse(const TickContext& context, const Error& error) {
  ++context.tally.refused_inputs;
  context.tally.last_refusal = error.message;
}

}  // namespace parhelion::tick
