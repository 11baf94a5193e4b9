#include "tests/bench/queries/peers.h"

namespace hulld::bench {

std::vector<std::unique_ptr<QueryMethod>> MakePeers() {
  std::vector<std::unique_ptr<QueryMethod>> peers;
#ifdef HULLD_HAVE_FCL
  AddFcl(peers);
#endif
#ifdef HULLD_HAVE_CCD
  AddLibccd(peers);
#endif
#ifdef HULLD_HAVE_BULLET
  AddBullet(peers);
#endif
  return peers;
}

}  // namespace hulld::bench
