#ifndef HULLD_CLIENT_HULLCTL_PRINTING_STORE_TEXT_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_STORE_TEXT_H_

#include <string>

#include "hulld/v1/geometry.pb.h"

namespace hulld {

// The stores of an answer: one, or several separated by spaces.
std::string StoresText(const v1::ResponseHeader& header);
// Its revision; with several stores, STORE:REVISION for each, as --at-least takes them.
std::string RevisionsText(const v1::ResponseHeader& header);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_STORE_TEXT_H_
