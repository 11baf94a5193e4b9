#ifndef HULLD_TESTS_FUZZ_FILES_FILE_MUTATION_H_
#define HULLD_TESTS_FUZZ_FILES_FILE_MUTATION_H_

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace hulld::fuzz {

// Mutates `content` once: swaps, repeats, or drops a line, number, binary word, or tag, replaces a
// number or word by an extreme value, or truncates the file. next(n) chooses a number below n.
void ChangeStructure(const std::function<size_t(size_t)>& next, std::string* content);

// Words and numbers of these formats, valid and invalid.
const std::vector<std::string>& FileTokens();

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_FILES_FILE_MUTATION_H_
