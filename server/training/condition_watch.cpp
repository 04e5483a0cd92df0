#include "server/training/condition_watch.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::training {
namespace {

constexpr const char* kAnybody = "any";

bool is_contact(EventKind kind) {
  return kind == EventKind::contact_started || kind == EventKind::contact_continues ||
         kind == EventKind::contact_ended;
}

/// Events for which subject and object are equivalent here: contacts, and hazards set off by the object. Of
/// two real robots in contact only the subject drove into the other.
bool is_of_both(const Event& event) {
  return (is_contact(event.kind) && event.pair != PairKind::real_real) ||
         event.kind == EventKind::hazard_triggered;
}

bool matches(const Condition& condition, const Event& event, const std::string& robot) {
  if (event.kind != condition.event || event.undetectable) return false;
  if (!condition.text.empty() && event.text != condition.text) return false;
  const bool anybody = condition.subject == kAnybody;
  const std::string& subject = condition.subject.empty() ? robot : condition.subject;
  const auto fits = [&](const std::string& who, const std::string& whom) {
    return (anybody || who == subject) && (condition.object.empty() || whom == condition.object);
  };
  if (!fits(event.subject, event.object) && !(is_of_both(event) && fits(event.object, event.subject)))
    return false;
  return event.impulse >= condition.impulse && (!condition.min || event.value >= *condition.min) &&
         (!condition.max || event.value <= *condition.max);
}

/// The event type of a handling condition.
EventKind handled(Condition::Kind kind) {
  if (kind == Condition::Kind::grip) return EventKind::gripped;
  return kind == Condition::Kind::lift ? EventKind::lifted : EventKind::placed;
}

/// Current value of a threshold condition; none: the robot is not present.
std::optional<double> amount_of(Condition::Kind kind, const GradedWorld& world) {
  const auto motion = world.motion();
  if (!motion) return std::nullopt;
  switch (kind) {
    case Condition::Kind::pitch:
      return std::abs(motion->pitch);
    case Condition::Kind::roll:
      return std::abs(motion->roll);
    case Condition::Kind::yaw_rate:
      return std::abs(motion->yaw_rate);
    default:
      return motion->speed;
  }
}

}  // namespace

ConditionWatch::ConditionWatch(const Condition& condition, SimulationTime begin, bool anew)
    : condition_(&condition), begin_(begin), spent_(anew) {
  const bool in_order = condition.kind == Condition::Kind::then;
  for (const Condition& part : condition.parts) {
    parts_.emplace_back(part, begin, anew);
    if (in_order) break;
  }
  for (const Condition& never : condition.never) never_.emplace_back(never, begin);
}

Verdict ConditionWatch::look(const Moment& moment) {
  if (verdict_ != Verdict::open) return verdict_;
  const bool late = condition_->within && moment.stamp > begin_ + seconds(*condition_->within);
  for (ConditionWatch& never : never_) {
    if (never.look(moment) != Verdict::held) continue;
    cause_ = never.cause();
    return verdict_ = Verdict::failed;
  }
  return verdict_ = late ? Verdict::failed : judge(moment);
}

Verdict ConditionWatch::judge(const Moment& moment) {
  const GradedWorld& world = moment.world;
  switch (condition_->kind) {
    case Condition::Kind::event:
      return judge_event(moment);
    case Condition::Kind::reach:
      if (moment.event && moment.event->kind == EventKind::zone_entered &&
          moment.event->subject == world.robot() && moment.event->object == condition_->target)
        cause_ = *moment.event;
      return held_for(world.in_zone(condition_->target), moment.stamp, 0);
    case Condition::Kind::pass:
      return judge_pass(moment);
    case Condition::Kind::climb: {
      if (!moment.event || moment.event->kind != EventKind::step_climbed ||
          moment.event->subject != world.robot())
        return Verdict::open;
      const ModelEntity* top = world.top_of(condition_->target);
      return top && top->name == moment.event->object ? count(*moment.event) : Verdict::open;
    }
    case Condition::Kind::near:
    case Condition::Kind::follow:
      return held_for(world.is_near(condition_->target, condition_->distance), moment.stamp,
                      condition_->duration);
    case Condition::Kind::avoid:
      return judge_avoid(moment);
    case Condition::Kind::report:
      return judge_report(moment);
    case Condition::Kind::grip:
    case Condition::Kind::lift:
    case Condition::Kind::place:
      return judge_handling(moment);
    case Condition::Kind::pitch:
    case Condition::Kind::roll:
    case Condition::Kind::yaw_rate:
    case Condition::Kind::speed: {
      const auto amount = amount_of(condition_->kind, world);
      return held_for(amount && *amount >= condition_->amount, moment.stamp, condition_->duration);
    }
    case Condition::Kind::still:
      return held_for(!world.moves(), moment.stamp, condition_->duration);
    case Condition::Kind::inspect:
      return held_for(world.sees(condition_->target, condition_->distance), moment.stamp,
                      condition_->duration);
    case Condition::Kind::all:
    case Condition::Kind::any:
      return judge_parts(moment);
    case Condition::Kind::then:
      return judge_order(moment);
  }
  return Verdict::open;
}

Verdict ConditionWatch::count(const Event& event) {
  cause_ = event;
  return ++seen_ >= condition_->count ? Verdict::held : Verdict::open;
}

Verdict ConditionWatch::judge_event(const Moment& moment) {
  if (!moment.event || !matches(*condition_, *moment.event, moment.world.robot())) return Verdict::open;
  return count(*moment.event);
}

/// Fails at the first violation; time counts from the start of the watch.
Verdict ConditionWatch::judge_avoid(const Moment& moment) {
  Condition touch;
  touch.object = condition_->target;
  // A contact that exists at the start does not start again.
  if (moment.event && moment.event->kind == EventKind::contact_continues) touch.event = moment.event->kind;
  const bool touched = moment.event && matches(touch, *moment.event, moment.world.robot());
  if (touched) cause_ = *moment.event;
  const bool near =
      condition_->distance > 0 && moment.world.is_near(condition_->target, condition_->distance);
  if (touched || near) return Verdict::failed;
  return moment.stamp - begin_ >= seconds(condition_->duration) ? Verdict::held : Verdict::open;
}

Verdict ConditionWatch::judge_report(const Moment& moment) {
  const Event* event = moment.event;
  // Reported by the trainee, whichever robot is graded.
  if (!event || event->kind != EventKind::object_reported || event->object != condition_->target)
    return Verdict::open;
  if (condition_->distance > 0 && !(event->value >= 0 && event->value <= condition_->distance))
    return Verdict::open;
  return count(*event);
}

Verdict ConditionWatch::judge_handling(const Moment& moment) {
  const Event* event = moment.event;
  if (!event || event->kind != handled(condition_->kind) || event->subject != moment.world.robot())
    return Verdict::open;
  const bool placed = event->kind == EventKind::placed;
  if ((placed ? event->text : event->object) != condition_->target) return Verdict::open;
  if (placed && !condition_->into.empty() && event->object != condition_->into) return Verdict::open;
  return count(*event);
}

/// In on one side of the door's plane, out on the other.
Verdict ConditionWatch::judge_pass(const Moment& moment) {
  if (!moment.event || moment.event->subject != moment.world.robot() ||
      moment.event->object != condition_->target)
    return Verdict::open;
  const Event& event = *moment.event;
  const ModelEntity* door = moment.world.find_entity(condition_->target);
  if (!door) return Verdict::open;
  const Eigen::Isometry3d& T_map_door = door->T_map_body.isometry();
  const double side = T_map_door.linear().col(1).dot(event.position - T_map_door.translation());
  if (event.kind == EventKind::door_space_entered) came_from_ = side;
  if (event.kind != EventKind::door_space_left || !came_from_) return Verdict::open;
  const bool through = side * *came_from_ < 0;
  came_from_.reset();
  return through ? count(event) : Verdict::open;
}

Verdict ConditionWatch::judge_parts(const Moment& moment) {
  const bool all = condition_->kind == Condition::Kind::all;
  std::size_t held = 0, failed = 0;
  for (ConditionWatch& part : parts_) {
    const bool was_open = part.verdict_ == Verdict::open;
    const Verdict verdict = part.look(moment);
    if (was_open && verdict != Verdict::open && part.cause()) cause_ = part.cause();
    held += verdict == Verdict::held;
    failed += verdict == Verdict::failed;
  }
  if (held >= (all ? parts_.size() : 1)) return Verdict::held;
  return failed >= (all ? 1 : parts_.size()) ? Verdict::failed : Verdict::open;
}

/// Each part is watched from the instant at which the previous one held; its final event does not start the
/// next.
Verdict ConditionWatch::judge_order(const Moment& moment) {
  const Verdict verdict = parts_.front().look(moment);
  if (verdict != Verdict::open && parts_.front().cause()) cause_ = parts_.front().cause();
  if (verdict != Verdict::held) return verdict;
  if (++part_ == condition_->parts.size()) return Verdict::held;
  parts_.clear();
  parts_.emplace_back(condition_->parts[part_], moment.stamp);
  return Verdict::open;
}

Verdict ConditionWatch::held_for(bool now, SimulationTime stamp, double duration) {
  if (!now) {
    since_.reset();
    spent_ = false;
  }
  if (!now || spent_) return Verdict::open;
  if (!since_) since_ = stamp;
  return stamp - *since_ >= seconds(duration) ? Verdict::held : Verdict::open;
}

}  // namespace parhelion::training
