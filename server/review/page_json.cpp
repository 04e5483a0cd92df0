// The page's data as JSON, rounded to visible precision.
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocols/yaml/base64.hpp"
#include "server/review/page.hpp"

namespace parhelion::review {
namespace {

using Json = nlohmann::ordered_json;

/// To thousandths (millimetres, milliseconds). The value must be finite.
double rounded(double value) {
  const double thousandths = std::round(value * 1000) / 1000;
  return thousandths == 0 ? 0 : thousandths;  // no -0
}

Json number_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json event_json(const Event& event, SimulationTime begin) {
  return {{"t", rounded((event.stamp - begin).seconds())},
          {"kind", to_string(event.kind)},
          {"subject", event.subject},
          {"object", event.object},
          {"x", rounded(event.position.x())},
          {"y", rounded(event.position.y())},
          {"impulse", rounded(event.impulse)},
          {"value", rounded(event.value)},
          {"undetectable", event.undetectable},
          {"text", event.text}};
}

/// As an event of its own kind.
Json mark_json(const Mark& mark) {
  return {{"t", rounded(mark.t)}, {"kind", "mark"}, {"subject", mark.by},    {"object", ""},
          {"impulse", 0},         {"value", 0},     {"undetectable", false}, {"text", mark.text}};
}

/// Events and marks, ordered by time.
Json events_json(const SessionReview& review) {
  Json events = Json::array();
  auto mark = review.marks.begin();
  for (const Event& event : review.events) {
    const double t = (event.stamp - review.begin).seconds();
    for (; mark != review.marks.end() && mark->t < t; ++mark) events.push_back(mark_json(*mark));
    events.push_back(event_json(event, review.begin));
  }
  for (; mark != review.marks.end(); ++mark) events.push_back(mark_json(*mark));
  return events;
}

Json seconds_after(const std::optional<SimulationTime>& at, SimulationTime begin) {
  return at ? Json(rounded((*at - begin).seconds())) : Json();
}

Json grade_json(const training::Grade& grade) {
  const SimulationTime begin = grade.begin;
  Json json{{"score", grade.score},
            {"awarded", grade.awarded},
            {"deducted", grade.deducted},
            {"max", grade.max},
            {"fraction", grade.fraction},
            {"grade", grade.grade},
            {"passed", grade.passed},
            {"complete", grade.complete},
            {"seconds", rounded((grade.end - begin).seconds())}};
  Json& tasks = json["tasks"] = Json::array();
  for (const training::TaskGrade& task : grade.tasks)
    tasks.push_back({{"name", task.name},
                     {"required", task.required},
                     {"outcome", to_string(task.outcome)},
                     {"points", task.points},
                     {"began", seconds_after(task.began, begin)},
                     {"ended", seconds_after(task.ended, begin)},
                     {"cause", task.cause ? event_json(*task.cause, begin) : Json()}});
  Json& deductions = json["deductions"] = Json::array();
  for (const training::Deduction& deduction : grade.deductions)
    deductions.push_back({{"t", rounded((deduction.at - begin).seconds())},
                          {"rule", deduction.rule},
                          {"points", deduction.points},
                          {"cause", deduction.cause ? event_json(*deduction.cause, begin) : Json()}});
  return json;
}

/// The training's figures that explain the points.
Json training_json(const Training& training) {
  Json json{{"text", training.text}, {"pass_mark", training.pass_mark}};
  json["limit"] = number_or_null(training.limit);
  Json& tasks = json["tasks"] = Json::array();
  for (const Task& task : training.tasks)
    tasks.push_back({{"name", task.name},
                     {"text", task.text},
                     {"points", task.points},
                     {"limit", number_or_null(task.limit)}});
  Json& rules = json["penalties"] = Json::array();
  for (const Penalty& penalty : training.penalties)
    rules.push_back({{"name", penalty.name},
                     {"points", penalty.points},
                     {"per_impulse", penalty.per_impulse},
                     {"max", number_or_null(penalty.max)}});
  return json;
}

Json trail_json(const Trail& trail) {
  Json json{
      {"name", trail.entity}, {"kind", to_string(trail.kind)}, {"length", rounded(trail.track.length())}};
  Json t = Json::array(), x = Json::array(), y = Json::array(), yaw = Json::array(), speed = Json::array(),
       jumps = Json::array();
  const auto points = trail.track.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    t.push_back(rounded(points[i].t));
    x.push_back(rounded(points[i].x));
    y.push_back(rounded(points[i].y));
    yaw.push_back(std::round(points[i].yaw * 100) / 100);
    speed.push_back(std::round(points[i].speed * 100) / 100);
    if (points[i].after_jump) jumps.push_back(i);
  }
  json["t"] = std::move(t);
  json["x"] = std::move(x);
  json["y"] = std::move(y);
  json["yaw"] = std::move(yaw);
  json["speed"] = std::move(speed);
  json["jumps"] = std::move(jumps);
  return json;
}

Json series_json(const Series& series, double scale, double less) {
  Json t = Json::array(), v = Json::array();
  for (const Series::Sample& sample : series.samples()) {
    t.push_back(rounded(sample.t));
    v.push_back(rounded(scale * (sample.value - less)));
  }
  return {{"width", series.width()}, {"t", std::move(t)}, {"v", std::move(v)}};
}

Json outline_json(const auto& corners) {
  Json json = Json::array();
  for (const Eigen::Vector2d& corner : corners) json.push_back({rounded(corner.x()), rounded(corner.y())});
  return json;
}

Json plan_json(const SessionReview& review) {
  Json json{{"cell", kPlanCell}};
  Json parts = Json::array(), rows = Json::array(), zones = Json::array();
  for (const PlanPart& part : review.plan.parts)
    parts.push_back(
        {{"name", part.name}, {"label", to_string(part.label)}, {"corners", outline_json(part.corners)}});
  for (const PlanRow& row : review.plan.rows)
    rows.push_back({rounded(row.y), rounded(row.left), rounded(row.right)});
  for (const Zone& zone : review.scenario.zones)
    zones.push_back({{"name", zone.name}, {"corners", outline_json(zone.outline)}});
  json["parts"] = std::move(parts);
  json["rows"] = std::move(rows);
  json["zones"] = std::move(zones);
  return json;
}

Json pictures_json(const SessionReview& review) {
  Json json = Json::array();
  for (const Picture& picture : review.pictures)
    json.push_back({{"t", rounded(picture.t)},
                    {"width", picture.width},
                    {"height", picture.height},
                    {"jpeg", yaml::to_base64(picture.jpeg)}});
  return json;
}

Json session_json(const SessionReview& review) {
  Json json{{"log", review.log},
            {"scenario", review.scenario.name},
            {"level", review.scenario.level},
            {"robot", review.robot},
            {"begin_us", review.begin.utime()},
            {"duration", rounded(review.duration)},
            {"cut_off", review.cut_off},
            {"skipped_bytes", review.skipped_bytes},
            {"footprint", outline_json(review.footprint)}};
  json["grade"] = review.grade ? grade_json(*review.grade) : Json();
  json["training"] = review.scenario.training ? training_json(*review.scenario.training) : Json();
  json["path"] = trail_json(review.path);
  Json& agents = json["agents"] = Json::array();
  for (const Trail& trail : review.agents) agents.push_back(trail_json(trail));
  json["events"] = events_json(review);
  json["events_left_out"] = review.events_left_out;
  Json& all = json["series"] = Json::object();
  for (const auto& [name, series] : review.series) {
    const auto smallest = review.min_delay.find(name);
    const bool is_delay = smallest != review.min_delay.end();
    all[name] = series_json(series, is_delay ? 1000 : 1, is_delay ? smallest->second : 0);
  }
  json["plan"] = plan_json(review);
  json["pictures"] = pictures_json(review);
  json["pictures_seen"] = review.pictures_seen;
  json["pictures_unreadable"] = review.pictures_unreadable;
  return json;
}

Json scores_json(const std::vector<SessionScore>& scores) {
  Json json = Json::array();
  for (const SessionScore& each : scores) {
    const training::Grade& grade = each.grade;
    json.push_back({{"log", each.log},
                    {"scenario", each.scenario},
                    {"begin_us", grade.begin.utime()},
                    {"score", grade.score},
                    {"max", grade.max},
                    {"fraction", grade.fraction},
                    {"grade", grade.grade},
                    {"passed", grade.passed},
                    {"complete", grade.complete},
                    {"deductions", grade.deductions.size()},
                    {"deducted", grade.deducted},
                    {"seconds", rounded((grade.end - grade.begin).seconds())}});
  }
  return json;
}

}  // namespace

std::string to_json(const ReviewPage& page) {
  Json json{{"program", tick::version_text()}};
  Json& sessions = json["sessions"] = Json::array();
  for (const SessionReview& review : page.sessions) sessions.push_back(session_json(review));
  json["earlier"] = scores_json(page.earlier);
  json["group"] = scores_json(page.group);
  // Names are untrusted bytes: invalid UTF-8 is replaced, non-ASCII is escaped.
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

}  // namespace parhelion::review
