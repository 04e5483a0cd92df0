// Who sees what: the pages of /ws/state, and the one way to send to them. Instructors and observers see
// everything, a trainee what the trainee's robots have sensed (server/runtime/trainee_view.hpp).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/runtime/trainee_view.hpp"
#include "server/station/entity_table.hpp"
#include "server/station/subscribers.hpp"

namespace parhelion::station {

/// Pages that are shown the same.
struct View {
  std::optional<runtime::TraineeView> trainee;  ///< none: everything
  EntityTable table;                            ///< of `world`
  WallTime table_due;                           ///< the table is renewed no earlier
  runtime::KnownWorld world;                    ///< the newest
  SharedText frames[2];                         ///< encoded `world`; index 1: injection is suspended

  /// The event and the name as this view's pages are told; none, empty: they are not.
  std::optional<Event> event(const Event& event) const;
  std::string name_of(const std::string& entity) const;
  std::string entity_of(const std::string& name) const;
  std::string text(const std::string& text) const { return trainee ? trainee->text(text) : text; }
  bool may_follow(const std::string& robot) const { return !trainee || trainee->may_follow(robot); }
};

/// True for a person who sees only what a robot has sensed.
inline bool is_trainee(const Identity& who) { return who.role == Role::trainee; }

/// Not thread-safe.
class Audience {
 public:
  /// The references must outlive this.
  Audience(const tick::Configuration& configuration, const runtime::Knowledge& knowledge);

  Subscribers& subscribers() { return subscribers_; }
  const Subscribers& subscribers() const { return subscribers_; }
  /// `robots`: those that the page's person drives, besides the one that it follows.
  void place(Subscriber& subscriber, const std::vector<std::string>& robots);
  View& view_of(const Subscriber& subscriber);
  /// All views with a page.
  std::vector<View*> views();
  /// For a new session.
  void restart();

  /// Makes the message of a view; empty: nothing for its pages.
  using Make = std::function<std::string(const View& view)>;
  /// To all pages, and to those that follow a robot. Encoded once for each view.
  void send(const Make& make, int slot = WebClient::kInOrder);
  void send_to_robot(std::size_t robot, const Make& make, int slot);
  void send_to(const Subscriber& subscriber, const Make& make, int slot = WebClient::kInOrder);

 private:
  using Receives = std::function<bool(const Subscriber&)>;
  void send_where(const Receives& receives, const Make& make, int slot);

  const tick::Configuration& configuration_;
  const runtime::Knowledge& knowledge_;
  Subscribers subscribers_;
  std::uint16_t tables_ = 0;           // where the numbers of the next view's tables begin
  std::map<std::string, View> views_;  // by Subscriber::view
};

}  // namespace parhelion::station
