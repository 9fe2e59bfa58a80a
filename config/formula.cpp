#include "config/formula.h"

#include <muParser.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include "hal/error.h"
#include "hal/one_line.h"
#include "model/expression.h"

namespace emtb {
namespace {

using Place = Expression::Place;

constexpr std::array quantity_names{"omega", "i_a", "theta", "u_ref", "t"};
constexpr std::size_t memory_place = quantity_names.size();
static_assert(Expression::quantities == memory_place + 1);

/// What a formula may name beside the quantities.
struct Names {
  std::string memory;  ///< empty: it remembers nothing
  std::span<const std::string> parameters;
};

/// A function as formulas call it: of one argument, two, or any number from two on.
struct Function {
  enum class Takes { one, two, several };
  const char* name;
  Operation operation;
  Takes takes = Takes::one;
};

constexpr std::array functions{Function{"abs", Operation::absolute},
                               Function{"sign", Operation::sign},
                               Function{"sqrt", Operation::square_root},
                               Function{"exp", Operation::exponential},
                               Function{"log", Operation::logarithm},
                               Function{"ln", Operation::logarithm},
                               Function{"sin", Operation::sine},
                               Function{"cos", Operation::cosine},
                               Function{"tan", Operation::tangent},
                               Function{"asin", Operation::arc_sine},
                               Function{"acos", Operation::arc_cosine},
                               Function{"atan", Operation::arc_tangent},
                               Function{"atan2", Operation::arc_tangent_of_two, Function::Takes::two},
                               Function{"sinh", Operation::hyperbolic_sine},
                               Function{"cosh", Operation::hyperbolic_cosine},
                               Function{"tanh", Operation::hyperbolic_tangent},
                               Function{"rint", Operation::round},
                               Function{"min", Operation::smaller, Function::Takes::several},
                               Function{"max", Operation::larger, Function::Takes::several}};

// muParser only parses: what its functions return when it tries the formula once is of no interest.
double of_one(void*, double) { return 0; }
double of_two(void*, double, double) { return 0; }
double of_several(void*, const double*, int) { return 0; }
double minus_sign(double) { return 0; }
double plus_sign(double) { return 0; }

/// muParser with the language of formulas, and a variable for each quantity and parameter.
class FormulaReader {
 public:
  FormulaReader(const std::string& text, const Names& names)
      : variables_(Expression::quantities + names.parameters.size()) {
    parser_.EnableOptimizer(false);  // Expression does what can be done ahead; a plain list is easier to follow
    parser_.ClearFun();
    parser_.ClearConst();
    parser_.ClearInfixOprt();
    parser_.DefineInfixOprt("-", minus_sign);
    parser_.DefineInfixOprt("+", plus_sign);
    parser_.DefineConst("pi", std::numbers::pi);
    for (const Function& f : functions) {
      void* row = const_cast<Function*>(&f);  // how the list below tells which function it calls; never written to
      if (f.takes == Function::Takes::one) parser_.DefineFunUserData(f.name, of_one, row, false);
      if (f.takes == Function::Takes::two) parser_.DefineFunUserData(f.name, of_two, row, false);
      if (f.takes == Function::Takes::several) parser_.DefineFunUserData(f.name, of_several, row, false);
    }
    for (std::size_t i = 0; i < quantity_names.size(); ++i) parser_.DefineVar(quantity_names[i], &variables_[i]);
    if (!names.memory.empty()) parser_.DefineVar(names.memory, &variables_[memory_place]);
    for (std::size_t i = 0; i < names.parameters.size(); ++i) {
      parser_.DefineVar(names.parameters[i], &variables_[Expression::quantities + i]);
    }
    const auto control = [](char c) {
      return (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' && c != '\r') || c == 0x7f;
    };
    if (std::ranges::any_of(text, control)) {
      throw ModelError("holds a control character. Write it in one line of plain characters");
    }
    parser_.SetExpr(text);
    parser_.Eval();  // parses
  }

  const mu::SToken* begin() const { return parser_.GetByteCode().GetBase(); }
  bool one_result() const { return parser_.GetNumResults() == 1; }

  /// Which variable a step of the list reads.
  std::size_t variable(const mu::SToken& token) const {
    return static_cast<std::size_t>(token.Val.ptr - variables_.data());
  }

 private:
  std::vector<double> variables_;
  mu::Parser parser_;
};

/// Follows muParser's list of steps on a stack, and writes each into the expression instead of computing it. Both sides
/// of a condition are written; the last step chooses.
class Translation {
 public:
  explicit Translation(std::size_t parameters) : expression(std::make_shared<Expression>(parameters)) {}

  std::shared_ptr<Expression> expression;
  std::vector<bool> used = std::vector<bool>(Expression::quantities);

  void follow(const FormulaReader& reader, std::size_t variables) {
    used.resize(variables);
    for (const mu::SToken* token = reader.begin(); token->Cmd != mu::cmEND; ++token) {
      if (token->Cmd == mu::cmVAR) used[reader.variable(*token)] = true;
      step(*token, reader);
    }
    expression->set_result(pop());
  }

 private:
  Place pop() {
    if (stack_.empty()) throw ModelError("cannot be read: something is missing before an operator");
    const Place top = stack_.back();
    stack_.pop_back();
    return top;
  }
  void unary(Operation operation) { stack_.push_back(expression->apply(operation, pop())); }
  void binary(Operation operation) {
    const Place right = pop(), left = pop();
    stack_.push_back(expression->apply(operation, left, right));
  }
  void swapped(Operation operation) {
    const Place right = pop(), left = pop();
    stack_.push_back(expression->apply(operation, right, left));
  }
  void is_not(Operation operation) {
    binary(operation);
    stack_.push_back(expression->apply(Operation::equal, pop(), expression->constant(0)));
  }

  void call(const mu::SToken& token) {
    if (token.Fun.cb._pUserData == nullptr) {
      if (token.Fun.cb._pRawFun == reinterpret_cast<mu::erased_fun_type>(&minus_sign)) unary(Operation::negate);
      return;  // a plus sign does nothing
    }
    const auto& f = *static_cast<const Function*>(token.Fun.cb._pUserData);
    if (f.takes == Function::Takes::one) return unary(f.operation);
    // muParser writes the number of arguments of a function that takes any number as a negative one.
    for (int arguments = std::abs(token.Fun.argc); arguments > 1; --arguments) binary(f.operation);
  }

  void step(const mu::SToken& token, const FormulaReader& reader) {
    switch (token.Cmd) {
      case mu::cmVAL:
        return stack_.push_back(expression->constant(token.Val.data2));
      case mu::cmVAR:
        return stack_.push_back(static_cast<Place>(reader.variable(token)));
      case mu::cmADD:
        return binary(Operation::add);
      case mu::cmSUB:
        return binary(Operation::subtract);
      case mu::cmMUL:
        return binary(Operation::multiply);
      case mu::cmDIV:
        return binary(Operation::divide);
      case mu::cmPOW:
        return binary(Operation::power);
      case mu::cmLT:
        return binary(Operation::less);
      case mu::cmLE:
        return binary(Operation::less_or_equal);
      case mu::cmGT:
        return swapped(Operation::less);
      case mu::cmGE:
        return swapped(Operation::less_or_equal);
      case mu::cmEQ:
        return binary(Operation::equal);
      case mu::cmNEQ:
        return is_not(Operation::equal);
      case mu::cmLAND:
        return binary(Operation::both);
      case mu::cmLOR:
        return binary(Operation::either);
      case mu::cmIF:
        return conditions_.push_back(pop());
      case mu::cmELSE:
        return;
      case mu::cmENDIF: {
        const Place otherwise = pop(), then = pop();
        stack_.push_back(expression->apply(Operation::choose, conditions_.back(), then, otherwise));
        return conditions_.pop_back();
      }
      case mu::cmFUNC:
        return call(token);
      case mu::cmASSIGN:
        throw ModelError("assigns with `=`. Write == to compare");
      default:
        throw ModelError("holds something that a formula of numbers cannot: a text, or a list");
    }
  }

  std::vector<Place> stack_, conditions_;
};

std::string known_names(const Names& known) {
  std::string names;
  for (const char* name : quantity_names) names += (names.empty() ? "" : ", ") + std::string(name);
  if (!known.memory.empty()) names += ", " + known.memory;
  for (const std::string& name : known.parameters) names += ", " + name;
  return names;
}

/// What muParser complains of, in the words of a person who wrote a formula.
std::string complaint_of(const mu::ParserError& e, const std::string& text, const Names& names) {
  const auto end = static_cast<int>(text.size());
  const int place = e.GetPos() < 0 || e.GetPos() > end ? end : e.GetPos();
  const std::string column = " at column " + std::to_string(place + 1) + " of `" + text + "`";
  switch (e.GetCode()) {
    case mu::ecUNASSIGNABLE_TOKEN: {
      // The token may be all that is left of the formula.
      const std::string& rest = e.GetToken();
      const auto length = rest.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_");
      const std::string name = rest.substr(0, length);
      if (name.empty()) return "cannot be read from `" + rest + "`" + column;
      return "uses `" + name + "`" + column + ", which is not known. Known: " + known_names(names) +
             ", pi, and the functions " + formula_functions() + ". Anything else goes under `parameters`";
    }
    case mu::ecUNEXPECTED_EOF:
      return "ends too early" + column;
    case mu::ecEMPTY_EXPRESSION:
      return "is empty. Write a formula such as \"-c3*omega^3\"";
    case mu::ecMISSING_PARENS:
      return "has a bracket that is not closed" + column;
    case mu::ecTOO_FEW_PARAMS:
    case mu::ecTOO_MANY_PARAMS:
      return "calls " + e.GetToken() + "() with too " + (e.GetCode() == mu::ecTOO_FEW_PARAMS ? "few" : "many") +
             " arguments" + column;
    default:
      if (!e.GetToken().empty()) return "cannot be read: `" + e.GetToken() + "` is out of place" + column;
      return "cannot be read" + column + " (" + e.GetMsg() + ")";
  }
}

}  // namespace

ParsedFormula parse_formula_with(const std::string& memory, const std::string& text,
                                 std::span<const std::string> parameters) {
  const Names names{memory, parameters};
  try {
    const FormulaReader reader(text, names);
    if (!reader.one_result()) throw ModelError("has several results, parted by commas. A formula has one");
    Translation translation(parameters.size());
    translation.follow(reader, Expression::quantities + parameters.size());
    const std::vector<bool>& used = translation.used;
    return {translation.expression, used[memory_place], {used.begin() + Expression::quantities, used.end()}};
  } catch (const mu::ParserError& e) {
    throw ModelError(in_one_line(complaint_of(e, text, names)));
  }
}

void check_all_used(std::span<const std::string> parameters, const std::vector<bool>& uses) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!uses[i]) throw ModelError("does not use its parameter " + parameters[i] + ". Use it, or leave it away");
  }
}

std::shared_ptr<const Term> parse_formula(const std::string& text, std::span<const std::string> parameters) {
  ParsedFormula formula = parse_formula_with("", text, parameters);
  check_all_used(parameters, formula.uses);
  return formula.term;
}

std::string formula_functions() {
  std::string names;
  for (const Function& f : functions) names += (names.empty() ? "" : ", ") + std::string(f.name);
  return names;
}

bool means_something_in_formulas(std::string_view name) {
  return name == "pi" || std::ranges::find(quantity_names, name) != quantity_names.end() ||
         std::ranges::find(functions, name, &Function::name) != functions.end();
}

}  // namespace emtb
