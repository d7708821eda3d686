"""From feature streams to labelled phrases: unimodal clustering with parallel HMMs (Özkul 2012, chapter 4)."""
