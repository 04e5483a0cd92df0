// People found in made-up depth images.
#pragma once

#include <array>
#include <vector>

#include "fusion/people/fused_people.hpp"
#include "fusion/people/people_tracker.hpp"
#include "tests/fusion/people/depth_room.hpp"
#include "tests/fusion/people/evaluation.hpp"

namespace parhelion::test {

/// Persons count from this number of pixels in an image and up to this range.
inline constexpr int kVisiblePixels = 150;
inline constexpr double kVisibleInDepth = 5;  // m

/// Legs and chest, each with a tracker of its own.
class TwoSlices {
 public:
  /// Who is there after an image, as the tracker of a single sensor would report it.
  std::vector<people::Mover> update(const DepthRoom& room, const DepthRoomImage& image) {
    for (std::size_t i = 0; i < slices_.size(); ++i) {
      people::DepthSlice& slice = slices_[i];
      if (!slice.set(room.view(image))) continue;
      const auto walls = room.building(slice);
      fused_.set(i,
                 trackers_[i].update({0,
                                      slice.scan(),
                                      slice.laser(),
                                      slice.motion(),
                                      slice.beam_time(),
                                      walls,
                                      room.sigma,
                                      image.stamp,
                                      {}}),
                 image.stamp);
    }
    std::vector<people::Mover> movers;
    for (const people::FusedPerson& person : fused_.persons()) {
      people::Mover& mover = movers.emplace_back();
      mover.id = person.id;
      mover.kind = people::MoverClass::person;
      mover.position = person.position;
      mover.stamp = person.stamp;
      mover.seen = person.seen;
    }
    return movers;
  }

 private:
  std::array<people::DepthSlice, 2> slices_ = people::depth_slices();
  std::array<people::PeopleTracker, 2> trackers_{people::PeopleTracker(people::slice_people_options()),
                                                 people::PeopleTracker(people::slice_people_options())};
  people::FusedPeople fused_;
};

inline PeopleScore score(const DepthRoomOptions& options) {
  const DepthRoom room = make_depth_room(options);
  TwoSlices slices;
  PeopleScore result;
  for (const auto& image : room.images) {
    const auto movers = slices.update(room, image);
    std::vector<KnownPerson> known;
    for (const TruePerson& person : image.people) {
      const double range = (person.position - image.T_map_depth.translation().head<2>()).norm();
      known.push_back(
          {person.id, person.position, range < kVisibleInDepth && person.beams >= kVisiblePixels});
    }
    result.add(movers, known, true, 1 / options.rate);
  }
  result.finish();
  return result;
}

}  // namespace parhelion::test
