// Further kinds of hard site, one per file. Each draws its site with the pen that it is given.
#pragma once

#include "tests/mean_sites/mean_site.hpp"

namespace parhelion::test {

MeanSite attic(SitePen& pen);           ///< a pitched roof on knee walls
MeanSite bulkheads(SitePen& pen);       ///< a plant with a round bulkhead, tanks and pipes
MeanSite car_park(SitePen& pen);        ///< low, with pillars and rows of cars
MeanSite carriage(SitePen& pen);        ///< rows of seats in a bus or train
MeanSite container_yard(SitePen& pen);  ///< containers and lorries before a facade; no ceiling
MeanSite cubicles(SitePen& pen);        ///< partitions of 3 to 5 cm, up to the ceiling or not
MeanSite mirror_hall(SitePen& pen);     ///< a mirror of 2.5 to 5 m in a wall
MeanSite rubble(SitePen& pen);          ///< a room half full of rubble, a person under a slab
MeanSite split_level(SitePen& pen);     ///< three rooms whose floors are not level with each other
MeanSite stage(SitePen& pen);           ///< a platform with steps before rows of chairs
MeanSite tunnel(SitePen& pen);          ///< upright walls under a vault
MeanSite walkers(SitePen& pen);         ///< a hall in which persons walk while it is scanned

}  // namespace parhelion::test
