// The classifiers of segments, tracks and pairs of both. Trained on synthetic scans only:
// tests/bench/train_people.cpp.
#pragma once

#include "protocols/boosted_trees.hpp"

namespace parhelion::people {

/// Log-odds that a segment (SegmentFeatures) is a person's leg, legs or body, and that a track
/// (TrackFeatures) is a person.
Trees segment_trees();
Trees track_trees();
/// Log-odds that a segment is part of a track (PairFeatures).
Trees pair_trees();

}  // namespace parhelion::people
