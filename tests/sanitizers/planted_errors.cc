#include "tests/sanitizers/planted_errors.h"

#include <cstddef>
#include <vector>

namespace hulld::planted {
namespace {

// Hides what happens to a pointer from the compiler, which would warn or optimize the defect away.
template <typename T>
T* Hidden(T* pointer) {
  T* volatile hidden = pointer;
  return hidden;
}

}  // namespace

double Read(const double* value) { return *value; }

double SumTooMany(const std::vector<double>& values) {
  const double* const first = Hidden(values.data());
  double sum = 0;
  for (size_t i = 0; i <= values.size(); ++i) sum += first[i];
  return sum;
}

double LastOfFreed(size_t count) {
  double* const values = new double[count];
  double* const kept = Hidden(values);
  for (size_t i = 0; i < count; ++i) values[i] = static_cast<double>(i);
  delete[] values;
  return kept[count - 1];
}

void Leak(size_t count) {
  double* lost = Hidden(new double[count]);
  lost[0] = 1;
  lost = nullptr;
}

int Successor(int value) { return value + 1; }

}  // namespace hulld::planted
