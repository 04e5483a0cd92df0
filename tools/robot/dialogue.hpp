// Questions to whoever describes a robot, and the checks of the answers.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace parhelion::tools {

/// The answer to a question, given what is likely. nullopt: nobody answers, and what is likely is taken.
using Ask = std::function<std::optional<std::string>(const std::string& question, const std::string& likely)>;

/// Thrown within this folder: an answer is wrong, at any depth.
struct WrongAnswer {
  std::string words;
};

/// A wrong answer is reported to `complain`, and the question is asked again; without `complain`, and where
/// nobody answers, WrongAnswer is thrown.
struct Dialogue {
  Ask ask;
  std::function<void(const std::string& words)> complain;

  /// `read`: of the answer's text; it throws WrongAnswer where that is wrong.
  template <class Read>
  auto answer(const std::string& question, const std::string& likely, Read&& read) const {
    for (;;) {
      const std::optional<std::string> text = ask(question, likely);
      if (!text || !complain) return read(text.value_or(likely));
      try {
        return read(*text);
      } catch (const WrongAnswer& wrong) {
        complain(wrong.words);
      }
    }
  }

  /// As written; a finite number of at least 0.
  std::string number(const std::string& question, const std::string& likely) const;
};

/// Finite numbers, separated by commas; nullopt: the text is something else.
std::optional<std::vector<double>> comma_separated(const std::string& text);

}  // namespace parhelion::tools
