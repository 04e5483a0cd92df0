#include "server/station/audience.hpp"

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr std::uint16_t kTables = 1009;  // numbers of one view's tables before they meet the next one's

}  // namespace

std::optional<Event> View::event(const Event& event) const {
  return trainee ? trainee->event(event) : std::optional(event);
}

std::string View::name_of(const std::string& entity) const {
  return trainee ? trainee->name_of(entity) : entity;
}

std::string View::entity_of(const std::string& name) const {
  return trainee ? trainee->entity_of(name) : name;
}

Audience::Audience(const tick::Configuration& configuration, const runtime::Knowledge& knowledge)
    : configuration_(configuration), knowledge_(knowledge) {}

void Audience::place(Subscriber& subscriber, const std::vector<std::string>& robots) {
  subscriber.view.clear();
  std::vector<std::string> his{configuration_.robot_at(subscriber.robot).name};
  his.insert(his.end(), robots.begin(), robots.end());
  if (is_trainee(subscriber.client->who()))
    for (const std::string& robot : his) subscriber.view += robot + "\n";
  const auto [place, is_new] = views_.try_emplace(subscriber.view);
  if (is_new) place->second.table = EntityTable(tables_ = static_cast<std::uint16_t>(tables_ + kTables));
  if (is_new && !subscriber.view.empty())
    place->second.trainee.emplace(configuration_, knowledge_, std::move(his));
  const auto& all = subscribers_.all();
  std::erase_if(views_, [&](const auto& each) {
    return std::none_of(all.begin(), all.end(),
                        [&](const Subscriber& other) { return other.view == each.first; });
  });
}

View& Audience::view_of(const Subscriber& subscriber) { return views_.at(subscriber.view); }

std::vector<View*> Audience::views() {
  std::vector<View*> all;
  for (auto& [key, view] : views_) all.push_back(&view);
  return all;
}

void Audience::restart() {
  for (auto& [key, view] : views_) {
    view.table.clear();
    view.table_due = {};
    view.world = {};
  }
}

void Audience::send_where(const Receives& receives, const Make& make, int slot) {
  std::map<std::string_view, SharedText> made;
  for (const Subscriber& subscriber : subscribers_.all()) {
    if (!receives(subscriber)) continue;
    const auto [place, is_new] = made.try_emplace(subscriber.view);
    if (is_new) place->second = shared_text(make(view_of(subscriber)));
    if (!place->second->empty()) subscriber.client->send(place->second, false, slot);
  }
}

void Audience::send(const Make& make, int slot) {
  send_where([](const Subscriber& /*any*/) { return true; }, make, slot);
}

void Audience::send_to_robot(std::size_t robot, const Make& make, int slot) {
  send_where([robot](const Subscriber& subscriber) { return subscriber.robot == robot; }, make, slot);
}

void Audience::send_to(const Subscriber& subscriber, const Make& make, int slot) {
  send_where([&](const Subscriber& other) { return &other == &subscriber; }, make, slot);
}

}  // namespace parhelion::station
