#ifndef HULLD_SERVER_PROCESS_DESCRIPTORS_H_
#define HULLD_SERVER_PROCESS_DESCRIPTORS_H_

#include <cstdint>
#include <utility>

namespace hulld::server {

// Owns a file descriptor and closes it on destruction.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();

  int number() const { return number_; }
  // Gives up ownership.
  int Release() { return std::exchange(number_, -1); }

 private:
  int number_;
};

// Returns the number of open descriptors of this process; 0 without /proc. Cost: ~1 us each.
uint64_t CountDescriptors();

// Returns the limit on open descriptors.
uint64_t MaxDescriptors();

// Raises that limit to the hard limit.
void RaiseDescriptorLimit();

// Opens /dev/null in place of each closed standard stream. Otherwise, a file or socket would get
// its number, and the log would be written to it. Writing to such a stream still fails.
void FillStandardStreams();

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_DESCRIPTORS_H_
