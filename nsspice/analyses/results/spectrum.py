"""Fourier coefficients and distortion of one signal."""

from __future__ import annotations

from dataclasses import dataclass

#: closed forms know a line to some 1e-13 of the signal: what is smaller is rounding
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Fourier coefficients of one signal.

    Parameters
    ----------
    signal : str
    frequency : float
        Of the fundamental [Hz].
    coefficients : tuple of complex
        ``c_0 ... c_n`` of ``y = sum c_k e^(i k w t)`` [V or A]; the amplitude of a harmonic is
        ``2 |c_k|``.
    rms : float
        Root of the mean square [V or A].
    distortion : float
        Total harmonic distortion, all harmonics counted; nan without a fundamental.
    """

    signal: str
    frequency: float
    coefficients: tuple[complex, ...]
    rms: float
    distortion: float

    @property
    def amplitudes(self) -> tuple[float, ...]:
        """Mean, then amplitudes of the harmonics [V or A]."""
        first, *others = self.coefficients
        return (first.real, *(2.0 * abs(c) for c in others))

    def has_line(self, amplitude: float) -> bool:
        """Return whether an amplitude is more than rounding next to the signal.

        Examples
        --------
        >>> square = Spectrum("v(a)", 1e3, (0j, 0.6 + 0j), 1.0, 0.0)
        >>> square.has_line(0.2), square.has_line(4e-16)
        (True, False)
        """
        return amplitude > ROUNDING * self.rms

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        return {
            "signal": self.signal,
            "frequency": self.frequency,
            "coefficients": [[c.real, c.imag] for c in self.coefficients],
            "rms": self.rms,
            "thd": self.distortion,
        }
