#include "fusion/pose/mrpt/engine/module.hpp"

const parhelion::pose::MrptEngines parhelion_mrpt_engines{parhelion::pose::mrpt_mapper,
                                                          parhelion::pose::mrpt_localizer};
