#ifndef HULLD_TESTS_CORE_CHECKS_CERTIFICATE_BRIDGE_H_
#define HULLD_TESTS_CORE_CHECKS_CERTIFICATE_BRIDGE_H_

#include <gtest/gtest.h>

#include "core/query/collision.h"
#include "tests/oracle/certificate_check.h"

namespace hulld {

// Converts a certificate for the oracle; doubles at one power of two.
oracle::Certificate ToOracle(const Certificate& certificate);

// True if an answer has a certificate iff neither hull is empty, and the certificate proves the
// relation in the oracle's arithmetic.
testing::AssertionResult CertificateIsValid(const Hull& a, const Pose& X_WA, const Hull& b,
                                            const Pose& X_WB, const Answer& answer);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_CERTIFICATE_BRIDGE_H_
