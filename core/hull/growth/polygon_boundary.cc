#include "core/hull/growth/polygon_boundary.h"

#include <iterator>

#include "core/base/check.h"

namespace hulld {

PolygonBoundary::PolygonBoundary(VertexTable& vertices, CoordinatePlane plane, VertexId a,
                                 VertexId b, VertexId c)
    : plane_(plane) {
  HULLD_CHECK(Orient2d(vertices[a], vertices[b], vertices[c], plane) != 0);
  for (const VertexId id : {a, b, c}) InsertVertex(vertices, id);
}

void PolygonBoundary::Insert(VertexTable& vertices, const Vector& point) {
  const Key key = KeyOf(point);
  for (const Chain* chain : {&lower_, &upper_}) {
    if (const auto found = chain->find(key); found != chain->end()) {
      vertices.CountDuplicate(found->second);
      return;
    }
  }
  if (!IsBeyond(vertices, lower_, +1, point) && !IsBeyond(vertices, upper_, -1, point)) return;
  InsertVertex(vertices, vertices.Add(point));
}

std::vector<VertexId> PolygonBoundary::Loop() const {
  HULLD_CHECK(lower_.size() >= 2 && upper_.size() >= 2);
  std::vector<VertexId> loop;
  loop.reserve(lower_.size() + upper_.size() - 2);
  for (const auto& [key, id] : lower_) loop.push_back(id);
  for (auto it = std::next(upper_.rbegin()); it != std::prev(upper_.rend()); ++it) {
    loop.push_back(it->second);
  }
  return loop;
}

void PolygonBoundary::Undo() {
  for (auto change = journal_.rbegin(); change != journal_.rend(); ++change) {
    Chain& chain = change->is_lower ? lower_ : upper_;
    if (change->came) {
      chain.erase(change->key);
    } else {
      chain.emplace(change->key, change->id);
    }
  }
  EndJournal();
}

void PolygonBoundary::InsertVertex(VertexTable& vertices, VertexId id) {
  const bool is_below = IsBeyond(vertices, lower_, +1, vertices[id]);
  if (is_below) Extend(vertices, lower_, +1, id);
  const bool is_above = IsBeyond(vertices, upper_, -1, vertices[id]);
  if (is_above) Extend(vertices, upper_, -1, id);
  // Otherwise the vertex would not be on any chain.
  HULLD_CHECK(is_below || is_above);
}

bool PolygonBoundary::IsBeyond(const VertexTable& vertices, const Chain& chain, int turn,
                               const Vector& point) const {
  const auto after = chain.lower_bound(KeyOf(point));
  if (after == chain.end() || after == chain.begin()) return true;
  const auto before = std::prev(after);
  return Orient2d(vertices[before->second], point, vertices[after->second], plane_) == turn;
}

// An end of the chains may become inner on one chain alone, never on both: a vertex leaves the
// polygon with its second chain.
void PolygonBoundary::Extend(VertexTable& vertices, Chain& chain, int turn, VertexId id) {
  const auto it = chain.emplace(KeyOf(vertices[id]), id).first;
  Note(chain, true, it->first, id);
  const auto turns = [&](Chain::iterator a, Chain::iterator b, Chain::iterator c) {
    return Orient2d(vertices[a->second], vertices[b->second], vertices[c->second], plane_) == turn;
  };
  while (it != chain.begin() && std::prev(it) != chain.begin() &&
         !turns(std::prev(it, 2), std::prev(it), it)) {
    Erase(vertices, chain, std::prev(it));
  }
  while (std::next(it) != chain.end() && std::next(it, 2) != chain.end() &&
         !turns(it, std::next(it), std::next(it, 2))) {
    Erase(vertices, chain, std::next(it));
  }
}

void PolygonBoundary::Erase(VertexTable& vertices, Chain& chain, Chain::iterator it) {
  const Chain& other = &chain == &lower_ ? upper_ : lower_;
  const auto [key, id] = *it;
  chain.erase(it);
  Note(chain, false, key, id);
  if (!other.contains(key)) vertices.Remove(id);
}

}  // namespace hulld
