#ifndef HULLD_CORE_HULL_GROWTH_BLOCK_INSERTION_H_
#define HULLD_CORE_HULL_GROWTH_BLOCK_INSERTION_H_

#include <cstdint>
#include <span>

#include "core/base/stop_poll.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"

namespace hulld {

// Adds a block of points to a surface, except those with the indices `done`, in an order that is
// fast for any input. The points that the map of directions cannot reject go into conflict lists
// or, if most points are outside, are inserted in rounds of growing size. Returns false, with some
// of the points added, if the poll stopped; its steps are insertions.
bool InsertBlock(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                 std::span<const uint32_t> done, StopPoll& poll);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_BLOCK_INSERTION_H_
