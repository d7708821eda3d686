"""Who is speaking: fusion of voice and lips, and open-set identification (Sargin 2006, chapter 2)."""
