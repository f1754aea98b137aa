"""Zero-phase smoothing in time (Butterworth forth and back; Winter 2009, chapter 3)."""

import numpy as np

ORDER = 2


def lowpass(values: np.ndarray, fps: float, cutoff_hz: float) -> np.ndarray:
    """Return the second-order Butterworth forth and back along axis 0: no lag, order four in all.

    A cut-off at or above half the frame rate, or a clip too short to filter, changes nothing. The
    ends are reflected oddly, so that a straight line stays one.
    """
    from scipy.signal import butter, sosfiltfilt

    padding = min(len(values) - 1, int(np.ceil(2.0 * fps / cutoff_hz)))
    if cutoff_hz >= 0.49 * fps or padding < 2:
        return np.array(values, float)
    sections = butter(ORDER, cutoff_hz, fs=fps, output="sos")
    result: np.ndarray = sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=padding)
    return result
