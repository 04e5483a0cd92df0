// Which sightings are of one person, and of whom.
#include <algorithm>
#include <cmath>

#include "fusion/people/fused_estimate.hpp"
#include "fusion/people/fused_people.hpp"

namespace parhelion::people {
namespace {

// Chosen on rooms of tests/fusion/people/depth_room with the seeds 7850000 to 7850099.
constexpr double kVoteMemory = 3;        // s, of votes for others than the present person
constexpr double kMaxVote = 2;           // s: who was seen for longer is as certain
constexpr double kStaleMemory = 0.5;     // s, of the votes of a track without returns: it may be lost
constexpr double kStaleVote = 0.25;      // what these count beside the votes of tracks with returns
constexpr double kContinues = 1;         // s of votes: where the person was expected
constexpr double kApart = 1.25;          // times the gate: who was one person is two from there on
constexpr Duration kNew = seconds(0.3);  // a track's first places are rough

}  // namespace

/// The first that is not before `key`.
std::vector<FusedPeople::Sighting>::iterator FusedPeople::find(const Key& key) {
  return std::lower_bound(sightings_.begin(), sightings_.end(), key,
                          [](const Sighting& s, const Key& k) { return s.key < k; });
}

/// Whether two sightings may be of one person. `wide`: times the gate.
bool FusedPeople::fit(const Sighting& a, const Sighting& b, double wide) const {
  const double gap = (a.here.position - b.here.position).norm();
  if (a.key.first == b.key.first) {
    if (gap < options_.body) return true;
    if (a.fresh && b.fresh) return false;
  }
  return gap < wide * options_.max_gap &&
         distance2(a.here, b.here, options_.pose_sigma) < wide * wide * options_.gate;
}

/// Brings the bonds up to date, and collects those that hold.
void FusedPeople::observe_bonds(SimulationTime now) {
  edges_.clear();
  for (auto& each : bonds_) each.second.near = false;
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    for (std::size_t j = i + 1; j < sightings_.size(); ++j) {
      const Sighting &a = sightings_[i], &b = sightings_[j];
      const bool near =
          (a.here.position - b.here.position).squaredNorm() < options_.max_gap * options_.max_gap;
      if (near || (a.person != 0 && a.person == b.person)) observe_bond(i, j, now);
    }
  }
  std::erase_if(bonds_, [](const auto& each) { return !each.second.near; });
}

/// Who was one stays one for a while though apart, unless another fits better; who were two become one when
/// they have been together for a while; who is new belongs to the nearest at once.
void FusedPeople::observe_bond(std::size_t i, std::size_t j, SimulationTime now) {
  const Sighting &a = sightings_[i], &b = sightings_[j];
  auto known = bonds_.find({a.key, b.key});
  const bool together = known != bonds_.end() && known->second.together;
  const bool fits = fit(a, b, together ? kApart : 1);
  if (!fits && !together) return;
  if (known == bonds_.end()) known = bonds_.try_emplace({a.key, b.key}, Bond{}).first;
  Bond& bond = known->second;
  bond.near = true;
  bond.a = i, bond.b = j;
  if (bond.since.ns == 0 || bond.fits != fits) {
    bond.fits = fits;
    bond.since = now;
  }
  const bool settled = now - bond.since >= options_.confirm;
  const bool same_sensor = a.key.first == b.key.first;
  const double cost = distance2(a.here, b.here, options_.pose_sigma) + (same_sensor ? 2 * options_.gate : 0);
  if (fits && together) {
    edges_.push_back({cost - options_.gate, i, j});
  } else if (fits) {
    const bool is_new = now - a.began < kNew || now - b.began < kNew;
    const bool alike = (a.here.velocity - b.here.velocity).norm() < options_.max_speed_gap;
    if (is_new || (settled && alike && !same_sensor)) edges_.push_back({cost, i, j});
  } else if (!settled) {
    edges_.push_back({cost + 10 * options_.gate, i, j});
  }
}

/// Of a person whom its sensor sees elsewhere a sighting is not.
bool FusedPeople::may_join(std::size_t a, std::size_t b) const {
  for (std::size_t i = a; i != kEnd; i = sightings_[i].next)
    for (std::size_t j = b; j != kEnd; j = sightings_[j].next)
      if (sightings_[i].key.first == sightings_[j].key.first && !fit(sightings_[i], sightings_[j]))
        return false;
  return true;
}

/// Makes bodies of the sightings: the best bonds first.
void FusedPeople::gather() {
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    sightings_[i].body = i;
    sightings_[i].next = kEnd;
  }
  std::sort(edges_.begin(), edges_.end());
  for (const Edge& edge : edges_) {
    const std::size_t a = sightings_[edge.a].body, b = sightings_[edge.b].body;
    if (a == b || !may_join(a, b)) continue;
    std::size_t last = a;
    while (sightings_[last].next != kEnd) last = sightings_[last].next;
    sightings_[last].next = b;
    for (std::size_t i = b; i != kEnd; i = sightings_[i].next) sightings_[i].body = a;
  }
  for (auto& [keys, bond] : bonds_) bond.together = sightings_[bond.a].body == sightings_[bond.b].body;
}

/// Gives the bodies to the persons with the most votes. A body counts as often as
/// sensors see it now: where two want to be one person, it is who is seen best.
void FusedPeople::identify(SimulationTime now) {
  bodies_.assign(sightings_.size(), {});
  for (const Sighting& s : sightings_) bodies_[s.body].fresh += s.fresh ? 1 : 0;
  candidates_.clear();
  for (std::uint32_t body = 0; body < bodies_.size(); ++body)
    if (sightings_[body].body == body) add_candidates(body, now);
  const auto columns = assignment_.solve(bodies_.size(), persons_.size(), candidates_, 0);
  for (std::size_t body = 0; body < bodies_.size(); ++body)
    if (columns[body] != Assignment::kNone)
      bodies_[body].person = persons_[static_cast<std::size_t>(columns[body])].id;
  recognise(now);
  for (Sighting& s : sightings_) {
    std::uint32_t& person = bodies_[s.body].person;
    if (person == 0) {
      FusedPerson someone;
      someone.id = person = ++last_id_;
      someone.stamp = now;
      persons_.push_back(someone);
    }
    s.joined = s.person != person;
    s.person = person;
  }
}

/// The persons for whom a body's sightings vote, and who may have walked there.
void FusedPeople::add_candidates(std::uint32_t body, SimulationTime now) {
  const std::size_t first = candidates_.size();
  for (std::size_t i = body; i != kEnd; i = sightings_[i].next) {
    for (const Vote& vote : sightings_[i].votes) {
      const auto person = std::lower_bound(persons_.begin(), persons_.end(), vote.person,
                                           [](const FusedPerson& p, std::uint32_t id) { return p.id < id; });
      if (vote.weight <= 0 || person == persons_.end() || person->id != vote.person) continue;
      // Twice what recognise() allows: a person whom others see has not stood still since.
      const double reach = 2 * (options_.max_gap + options_.wander * (now - person->seen).seconds());
      if ((sightings_[i].here.position - person->position).norm() > reach) continue;
      const auto column = static_cast<std::uint32_t>(person - persons_.begin());
      if (std::any_of(candidates_.begin() + static_cast<std::ptrdiff_t>(first), candidates_.end(),
                      [column](const Candidate& c) { return c.column == column; }))
        continue;
      double weight = 0;
      for (std::size_t j = body; j != kEnd; j = sightings_[j].next)
        weight += weight_of(sightings_[j], *person);
      candidates_.push_back({body, column, -weight * std::max(bodies_[body].fresh, 1)});
    }
  }
}

/// Bodies of nobody known: the nearest persons whom nobody sees.
void FusedPeople::recognise(SimulationTime now) {
  pairings_.clear();
  for (const Sighting& s : sightings_) {
    if (bodies_[s.body].person != 0) continue;
    for (std::size_t p = 0; p < persons_.size(); ++p) {
      const FusedPerson& person = persons_[p];
      const double unseen = std::min((now - person.seen).seconds(), options_.remembered.seconds());
      if ((s.here.position - person.position).norm() > options_.max_gap + options_.wander * unseen) continue;
      const double cost = distance2(s.here, person, options_.pose_sigma);
      if (cost < options_.gate) pairings_.push_back({cost, s.body, p});
    }
  }
  std::sort(pairings_.begin(), pairings_.end());
  for (const Pairing& each : pairings_) {
    const std::uint32_t id = persons_[each.person].id;
    const bool taken =
        std::any_of(bodies_.begin(), bodies_.end(), [id](const Body& b) { return b.person == id; });
    if (bodies_[each.body].person == 0 && !taken) bodies_[each.body].person = id;
  }
}

/// s: 0 of who never was this person.
double FusedPeople::weight_of(const Sighting& sighting, const FusedPerson& person) const {
  const double votes = votes_for(sighting, person.id);
  if (votes <= 0) return 0;
  return (votes + continues(sighting, person)) * (sighting.fresh ? 1 : kStaleVote);
}

/// How well a sighting continues the motion of a person, in seconds of votes.
double FusedPeople::continues(const Sighting& sighting, const FusedPerson& person) const {
  return kContinues *
         std::max(1 - distance2(sighting.here, person, options_.pose_sigma) / options_.gate, 0.0);
}

double FusedPeople::votes_for(const Sighting& sighting, std::uint32_t person) {
  for (const Vote& vote : sighting.votes)
    if (vote.person == person) return vote.weight;
  return 0;
}

/// Each track votes for its person, for as long as it has been seen as that.
void FusedPeople::vote() {
  for (Sighting& s : sightings_) {
    const double seen = std::max((s.mover.seen - s.voted).seconds(), 0.0);
    s.voted = s.mover.seen;
    double largest = 0;
    for (Vote& vote : s.votes) {
      vote.weight *= std::exp(-s.unseen / kStaleMemory - (vote.person == s.person ? 0 : seen / kVoteMemory));
      largest = std::max(largest, vote.weight);
    }
    auto own =
        std::find_if(s.votes.begin(), s.votes.end(), [&](const Vote& v) { return v.person == s.person; });
    if (own == s.votes.end()) {
      own = std::min_element(s.votes.begin(), s.votes.end(),
                             [](const Vote& a, const Vote& b) { return a.weight < b.weight; });
      *own = {s.person, 1e-3};
    }
    // Who became another stays that, also where the others leave it.
    if (s.joined) own->weight = std::max(own->weight, largest);
    own->weight = std::min(own->weight + seen, kMaxVote);
  }
}

}  // namespace parhelion::people
