"""Formulas that stand in a sentence as a program writes them, such as ``D/(N*c)``, as LaTeX."""

import re
from tokenize import TokenError

import sympy as sp
from sympy.parsing.sympy_parser import parse_expr

SYMBOLS = {
    "A_theta": r"A_\theta", "mu_s": r"\mu_\mathrm{s}", "mu_d": r"\mu_\mathrm{d}", "sigma_mu": r"\sigma_\mu",
    "sigma_theta": r"\sigma_\theta", "theta_c": r"\theta_\mathrm{c}", "alpha_c": r"\alpha_\mathrm{c}",
    "tau_dyn": r"\tau_\mathrm{dyn}", "tau_th": r"\tau_\mathrm{th}", "l_0": "l_0", "l0": "l_0", "x_G": "x_G",
    "F_n": "F_n", "Delta_f": r"\Delta_f", "Delta_theta_star": r"\Delta\theta^*", "c": r"\cos\alpha",
    "A_star": "A^*", "alpha_star": r"\alpha^*_{N,i}", "theta_q": r"\theta_q", "theta_1": r"\theta_1", "theta_2": r"\theta_2", "phi_q": r"\varphi_q", "v_n": "v_n", "w_n": "w_n",
    "omega": r"\omega",
    "s": r"\sin\alpha", "alpha": r"\alpha", "theta": r"\theta", "kappa": r"\kappa", "rho": r"\rho", "Phi": r"\Phi",
    "sigma": r"\sigma", "delta": r"\delta", "phi": r"\varphi", "pi": r"\pi", "r0": "r_0",
    **{letter: letter for letter in "A D E J L M N P R S T V Y a d f g h i j k l m n p q r t v w x z".split()},
}  # fmt: skip
"""How the names of the derivations are written."""
NAMES = {
    "jump": r"\Delta\theta", "eps": r"\varepsilon", "Delta_theta_plus": r"\Delta\theta^{+}",
    "Delta_theta_minus": r"\Delta\theta^{-}", "Delta_theta_star": r"\Delta\theta^{*}",
}  # fmt: skip
"""Names of the derivations' own values that would not be legible as they stand."""
FUNCTIONS = {"tan", "sin", "cos", "atan", "sqrt", "tension"}
ALONE = {"D", "N", "i", "theta", "kappa", "sigma", "alpha", "rho", "Phi"}
"""Names of one word that are no word of English, and no unit."""
_SIGNS = {"->": r" \to ", "=": " = ", "+": " + ", "-": " - "}
_STARRED = {r"\balpha\*_\{N,i\}": "alpha_star", r"\bA\*(?![\w(.])": "A_star", r"\bT\(": "tension("}
"""Names that Python does not allow, and the tension of a spring, which is a function of its number."""
_TRAILING = re.compile(r"[,;:.]?$")


def latex(value):
    """Return a value of the derivations as LaTeX, names of several letters in upright type."""
    symbols = getattr(value, "free_symbols", ())
    return sp.latex(value, symbol_names={each: tex for each in symbols if (tex := _named(each.name))})


def _named(name):
    """Return the LaTeX of a name that looks like a product of letters, or None for any other."""
    if re.fullmatch("[a-z]{2,}", name) and name not in NAMES and sp.latex(sp.Symbol(name)) == name:
        return rf"\,\mathrm{{{name}}}"
    return NAMES.get(name)


def _latex(text):
    """Return an expression as LaTeX, or None if it is none."""
    if re.fullmatch(r"\+[a-zA-Z]", text):
        return text
    for written, name in _STARRED.items():
        text = re.sub(written, name, text)
    names = re.findall(r"[A-Za-z_]\w*", text)
    if not re.fullmatch(r"[\w.+\-*/()]+", text) or not all(
        name in SYMBOLS or name in FUNCTIONS for name in names
    ):
        return None
    if re.fullmatch(r"-?\d*\.?\d+(e-?\d+)?", text):
        return text
    if re.search(r"\w\(", re.sub("|".join(FUNCTIONS), "", text)):
        return None  # a function of the text, such as I(h)
    symbols = {name: sp.Symbol(f"z_{name}" if name in "cs" else name) for name in SYMBOLS}  # last
    try:
        value = parse_expr(text, local_dict=symbols | {"tension": sp.Function("T")})
    except (SyntaxError, TypeError, ValueError, TokenError):
        return None
    written = sp.latex(value, symbol_names={symbols[name]: tex for name, tex in SYMBOLS.items()})
    written = re.sub(r"(?<!T)\{\\left\((\\?\w+) *\\right\)\}", r" \1", written)
    return re.sub(r"^- ", "-", written)


def _is_formula(text):
    """Tell whether a word is a formula by itself and no word or number."""
    if re.fullmatch(r"-?[\d.e-]+", text):
        return False
    return text in ALONE or bool(re.search(r"[_*/(]|^[-+][a-zA-Z]", text)) or text in ("l0", "r0")


def with_formulas(text):
    """Return a sentence with its program-like formulas as LaTeX between dollar signs.

    Text between dollar signs or back-quotes stays, and so does everything else that is no formula.
    """
    pieces = re.split(r"(\$.*?\$|`.*?`)", text)
    pieces[::2] = map(_in_words, pieces[::2])
    return "".join(pieces)


def _in_words(text):
    words, parts = text.split(" "), []
    while words:
        operand, taken = _operand(words)
        formula, end = [operand], taken
        while operand and end + 1 < len(words) and words[end] in _SIGNS and words[end - 1][-1] not in ",;:":
            following, more = _operand(words[end + 1 :])
            if following is None:
                break
            formula += [_SIGNS[words[end]], following]
            end += 1 + more
        punctuation = _TRAILING.search(words[end - 1])[0]
        if operand and (end > taken or _is_formula(_TRAILING.sub("", " ".join(words[:end])))):
            parts.append(f"${''.join(formula)}${punctuation}")
        else:
            parts.append(words[0])
            end = 1
        del words[:end]
    return " ".join(parts)


def _operand(words):
    """Return the first words as LaTeX, and how many: as many as close what brackets they open."""
    for taken in range(1, min(len(words), 40) + 1):
        text = _TRAILING.sub("", "".join(words[:taken]))
        if text.count("(") == text.count(")"):
            return (_latex(text) if text else None), taken
    return None, 1
