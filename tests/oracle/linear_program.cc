#include "tests/oracle/linear_program.h"

#include <cstddef>
#include <optional>

namespace hulld::oracle {
namespace {

// The basis starts as one artificial column per row. Artificial columns are numbered after the real
// ones and never re-enter the basis. Phase one drives their sum to zero.
class PhaseOne {
 public:
  PhaseOne(const std::vector<std::vector<Integer>>& columns, const std::vector<Integer>& rhs)
      : columns_(columns), rows_(rhs.size()), row_sign_(rows_, 1), determinant_(1) {
    // Rows with a negative right side are negated, so that the artificial basis is feasible.
    for (size_t i = 0; i < rows_; ++i) {
      if (rhs[i] < 0) row_sign_[i] = -1;
      basis_.push_back(columns_.size() + i);
      inverse_.emplace_back(rows_, Integer(0));
      inverse_[i][i] = 1;
      values_.push_back(row_sign_[i] < 0 ? Integer(-rhs[i]) : rhs[i]);
    }
  }

  bool Solve() {
    while (!ArtificialsAreZero()) {
      const std::optional<size_t> entering = EnteringColumn();
      if (!entering) return false;
      const std::vector<Integer> direction = TimesInverse(*entering);
      Pivot(LeavingRow(direction), *entering, direction);
    }
    return true;
  }

 private:
  bool IsArtificial(size_t row) const { return basis_[row] >= columns_.size(); }

  bool ArtificialsAreZero() const {
    for (size_t i = 0; i < rows_; ++i) {
      if (IsArtificial(i) && values_[i] != 0) return false;
    }
    return true;
  }

  // Returns determinant * B^-1 * column.
  std::vector<Integer> TimesInverse(size_t column) const {
    std::vector<Integer> result(rows_, Integer(0));
    for (size_t i = 0; i < rows_; ++i) {
      for (size_t k = 0; k < rows_; ++k) {
        result[i] += inverse_[i][k] * columns_[column][k] * row_sign_[k];
      }
    }
    return result;
  }

  // Returns the first column that lowers the sum of the artificials.
  std::optional<size_t> EnteringColumn() const {
    std::vector<Integer> price(rows_, Integer(0));
    for (size_t i = 0; i < rows_; ++i) {
      if (!IsArtificial(i)) continue;
      for (size_t k = 0; k < rows_; ++k) price[k] += inverse_[i][k] * row_sign_[k];
    }
    for (size_t j = 0; j < columns_.size(); ++j) {
      Integer gain = 0;
      for (size_t k = 0; k < rows_; ++k) gain += price[k] * columns_[j][k];
      if (gain > 0) return j;
    }
    return std::nullopt;
  }

  // Returns the row that first reaches zero, or the one with the lowest column among ties. A row
  // exists, because the sum of the artificials is bounded below.
  size_t LeavingRow(const std::vector<Integer>& direction) const {
    std::optional<size_t> best;
    for (size_t i = 0; i < rows_; ++i) {
      if (direction[i] <= 0) continue;
      if (!best) {
        best = i;
        continue;
      }
      const Integer here = values_[i] * direction[*best];
      const Integer there = values_[*best] * direction[i];
      if (here < there || (here == there && basis_[i] < basis_[*best])) best = i;
    }
    return *best;
  }

  void Pivot(size_t row, size_t column, const std::vector<Integer>& direction) {
    const Integer pivot = direction[row];
    for (size_t i = 0; i < rows_; ++i) {
      if (i == row) continue;
      for (size_t k = 0; k < rows_; ++k) {
        inverse_[i][k] = (inverse_[i][k] * pivot - direction[i] * inverse_[row][k]) / determinant_;
      }
      values_[i] = (values_[i] * pivot - direction[i] * values_[row]) / determinant_;
    }
    determinant_ = pivot;
    basis_[row] = column;
  }

  const std::vector<std::vector<Integer>>& columns_;
  size_t rows_;
  std::vector<int> row_sign_;
  std::vector<size_t> basis_;
  std::vector<std::vector<Integer>> inverse_;  // determinant_ * B^-1
  std::vector<Integer> values_;                // determinant_ * B^-1 * rhs
  Integer determinant_;                        // always positive
};

}  // namespace

bool HasNonnegativeSolution(const std::vector<std::vector<Integer>>& columns,
                            std::vector<Integer> rhs) {
  return PhaseOne(columns, rhs).Solve();
}

}  // namespace hulld::oracle
